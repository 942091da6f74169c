"""Paper and slides from built pages: names stay unique, links lead inside, solutions stand apart, decks are short."""

from __future__ import annotations

import print_book
import pytest
import slides

PAGE = """<html><body><article class="bd-article"><section><h1>{title}<a class="headerlink" href="#top">#</a></h1>
<p><a href="{other}.html#here">there</a> <a href="https://example.org/x">out</a> <a href="../_sources/x.ipynb">file</a></p>
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
    assert 'href="#02_two--here"' in text and 'id="02_two--s3"' in text
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
