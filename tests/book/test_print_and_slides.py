"""Paper, EPUB and slides from built pages: names stay unique, links lead inside, solutions stand apart, decks are short."""

from __future__ import annotations

import contextlib
import os
import re
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

import downloads
import epub_book
import print_book
import pytest
import slides

PAGE = """<html><body><article class="bd-article"><section><h1>{title}<a class="headerlink" href="#top">#</a></h1>
<p><a href="{other}.html#s1">there</a> <a href="https://example.org/x">out</a> <a href="../_sources/x.ipynb">file</a></p>
<p>Twice <span class="math">\\(N\\)</span> and <span class="math">\\(N\\)</span>; <a href="https://doi.org/a&lt;b&gt;c;2-4">old</a></p>
<ul class="simple"><li><p><strong>1.1</strong> an objective</p></li></ul>
{sections}
<div class="admonition solution dropdown" id="answer"><p>Forty-two.</p></div>
<section id="summary"><h2>Summary</h2><p>All in all.</p></section></section></article></body></html>"""
SECTION = """<section id="s{k}"><h2>Section {k}</h2><div class="math">x<span class="eqno">(1.{k})#</span></div>
<figure id="fig-{k}"><img class="only-light" src="p{k}.svg" alt="a picture"><img class="only-dark" src="p{k}-dark.svg" alt="">
<figcaption><span class="caption-text">One thing, e.g. {k}. Another thing.</span></figcaption></figure></section>"""


@pytest.fixture
def book(tmp_path):
    """A book of two chapters, the second with fifteen sections."""
    (tmp_path / "book").mkdir()
    for name, other, count in (("01_one", "02_two", 2), ("02_two", "01_one", 15)):
        sections = "\n".join(SECTION.format(k=k) for k in range(count))
        text = PAGE.format(title=f"Chapter {name}", other=other, sections=sections)
        (tmp_path / "book" / f"{name}.html").write_text(text, encoding="utf-8")
    (tmp_path / "toc.yml").write_text(
        "root: book/01_one\nparts: [{caption: Further, chapters: [{file: book/02_two}]}]\n", encoding="utf-8"
    )
    return tmp_path


def test_names_and_addresses_on_the_one_page():
    assert print_book.own_name("02_two.html#here", "book/01_one") == "02_two--here"
    assert print_book.own_name("02_two.html", "book/01_one") == "02_two--top"
    assert print_book.own_name("#here", "book/01_one") == "01_one--here"
    assert print_book.own_name("https://example.org/a.html", "book/01_one") is None
    assert print_book.own_name("../_sources/x.ipynb", "book/01_one") is None


def test_the_one_page_holds_both_chapters_their_numbers_and_the_solutions_at_the_end(book):
    text = print_book.one_page(book, book / "toc.yml", "A <book>", book, {"02_two--top": 17})
    assert 'href="#02_two--s1"' in text and 'id="02_two--s3"' in text
    assert '<a href="#02_two--top">17</a>' in text
    assert "A &lt;book&gt;" in text
    assert "only-dark" not in text and "headerlink" not in text and "_sources" not in text
    assert text.count("Forty-two.") == 2 and text.index("Forty-two.") > text.index('id="solutions"')
    assert 'href="https://example.org/x"' in text


def test_a_page_without_an_article_is_named(tmp_path):
    (tmp_path / "empty.html").write_text("<html></html>", encoding="utf-8")
    with pytest.raises(ValueError, match=r"empty\.html must hold an article"):
        print_book.article(tmp_path, "empty", tmp_path)


def test_a_deck_has_a_title_figures_with_one_sentence_and_a_summary(book):
    title, deck, shown = slides.slides_of(book / "book" / "02_two.html")
    assert title == "Chapter 02_two"
    assert len(deck) == slides.MOST and len(shown) == 15
    assert "an objective" in deck[0] and "All in all." in deck[-1]
    assert "One thing, e.g. 0." in deck[1] and "Another thing" not in deck[1]
    assert "(1.0)" not in deck[1] and "-dark" not in deck[1]


def test_the_first_sentence():
    assert slides.first_sentence("One. Two.") == "One."
    assert slides.first_sentence("By J. Fourier, once. Then more.") == "By J. Fourier, once."
    assert slides.first_sentence("No end") == "No end"


# --- the EPUB ----------------------------------------------------------------------------------------------------------

DRAWING = """<?xml version="1.0"?>
<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">
<svg xmlns="http://www.w3.org/2000/svg"><path id="empty"/><path id="full" d="M1 1"/></svg>"""


@pytest.fixture
def epub(book, monkeypatch):
    """The files of the EPUB of that book; MathJax is left away."""
    for k in range(15):
        (book / "book" / f"p{k}.svg").write_text(DRAWING, encoding="utf-8")
    monkeypatch.setattr(epub_book, "mathml", lambda formulas, _: {one: f"<math><mi>{one[0]}</mi></math>" for one in formulas})
    return epub_book.book_files(book, book / "toc.yml", book, "full")


def test_every_file_of_an_epub_is_xml_and_listed_and_every_link_leads_somewhere(epub):
    trees = {name: ElementTree.fromstring(text) for name, text in epub.items() if name.endswith((".xhtml", ".opf", ".svg"))}
    listed = {item.get("href") for item in trees["package.opf"].findall(".//{*}item")}
    assert listed == set(epub) - {"package.opf"}
    ids = {name: [one.get("id") for one in tree.iter() if one.get("id")] for name, tree in trees.items()}
    assert all(len(names) == len(set(names)) for names in ids.values())
    links = [link.get("href") for tree in trees.values() for link in tree.findall(".//{*}a")]
    inside = [link.split("#") for link in links if link and not link.startswith("https:")]
    assert len(inside) > 3
    for file, *name in inside:
        assert file in trees and set(name) <= set(ids[file]), (file, name)
    order = [item.get("idref") for item in trees["package.opf"].findall(".//{*}itemref")]
    assert order == [epub_book.key(name) for name in ("nav.xhtml", "01_one.xhtml", "02_two.xhtml", "solutions.xhtml")]


def test_an_epub_has_its_solutions_apart_and_its_formulas_numbered(epub):
    assert "Forty-two." not in epub["01_one.xhtml"] and epub["solutions.xhtml"].count("Forty-two.") == 2
    assert re.search(r'<span class="eqno">\(1\.0\)#</span><math', epub["01_one.xhtml"])
    assert "only-dark" not in epub["01_one.xhtml"] and "<script" not in epub["01_one.xhtml"]
    drawing = epub["images/p0.svg"]
    assert "DOCTYPE" not in drawing and '<path d="M0 0" id="empty"/>' in drawing and 'id="full" d="M1 1"' in drawing


def test_a_formula_that_mathjax_does_not_read_is_named(monkeypatch):
    class Page:
        """A page in which MathJax reads nothing but x."""

        goto = wait_for_function = lambda *args, **options: None

        def evaluate(self, code, formulas):
            """What MathJax would make of the formulas."""
            return ['<math class="a" data-b="c"><mi>x</mi></math>' if tex == "x" else "<merror/>" for tex, _ in formulas]

    monkeypatch.setattr(epub_book, "started_browser", lambda: contextlib.nullcontext(Page()))
    made = epub_book.mathml([("x", False), ("x", False)], Path("/x.js"))
    assert made == {("x", False): '<math alttext="x"><mi>x</mi></math>'}
    with pytest.raises(ValueError, match=r"MathJax must read every formula; it does not read '\\\\frac1'"):
        epub_book.mathml([("x", False), (r"\frac1", False)], Path("/x.js"))


def test_the_first_file_of_an_epub_names_its_kind(epub, tmp_path):
    epub_book.write_epub(epub, tmp_path / "x.epub")
    with zipfile.ZipFile(tmp_path / "x.epub") as made:
        first = made.infolist()[0]
        assert (first.filename, first.compress_type) == ("mimetype", zipfile.ZIP_STORED)
        assert made.read("mimetype") == b"application/epub+zip"
        assert set(made.namelist()) == {"mimetype", "META-INF/container.xml", *(f"book/{name}" for name in epub)}


def test_what_epubcheck_says_is_passed_on_and_its_absence_too(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert epub_book.complaints(tmp_path / "x.epub") is None
    fake = tmp_path / "epubcheck"
    fake.write_text("#!/bin/sh\necho 'ERROR(RSC-005): broken' >&2\nexit 1\n", encoding="utf-8")
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}/usr/bin{os.pathsep}/bin")
    assert epub_book.complaints(tmp_path / "x.epub") == ["ERROR(RSC-005): broken"]
    fake.write_text("#!/bin/sh\nexit 3\n", encoding="utf-8")
    assert epub_book.complaints(tmp_path / "x.epub") == ["EPUBCheck ended with 3"]


def test_the_front_page_offers_what_is_there_with_its_weight(tmp_path):
    page = tmp_path / "book" / "index.html"
    for folder in ("book", "_downloads", "slides"):
        (tmp_path / folder).mkdir()
    page.write_text('<p>a</p><p class="downloads"></p><p>b</p>', encoding="utf-8")
    downloads.offer(tmp_path)
    assert page.read_text(encoding="utf-8") == '<p>a</p><p class="downloads"></p><p>b</p>'
    (tmp_path / "_downloads" / f"{downloads.name('student')}.epub").write_bytes(bytes(3_000_000))
    (tmp_path / "_downloads" / f"{downloads.name('full')}.pdf").write_bytes(bytes(12_000_000))
    (tmp_path / "slides" / "index.html").write_text("", encoding="utf-8")
    for _ in range(2):  # once more changes nothing
        downloads.offer(tmp_path)
    said = page.read_text(encoding="utf-8")
    assert said.count("download>") == 2 and "PDF (12 MB)" in said and "EPUB (3 MB)" in said and "slides" in said
    assert all(Path(page.parent, link).exists() for link in re.findall('href="([^"]+)"', said))


def test_a_formula_that_comes_twice_is_one_in_both_places_and_an_old_doi_is_an_address(epub):
    for name in ("01_one.xhtml", "02_two.xhtml"):
        assert epub[name].count("<mi>N</mi>") == 2 and "\\(" not in epub[name]
        assert 'href="https://doi.org/a%3Cb%3Ec;2-4"' in epub[name]
