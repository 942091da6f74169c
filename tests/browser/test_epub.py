"""An EPUB of pages of the built book: formulas as MathML, pictures with texts, no script, and no complaint of EPUBCheck."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from concurrent.futures import ThreadPoolExecutor

import epub_book

MATH = "{http://www.w3.org/1998/Math/MathML}math"


def test_pages_of_the_book_as_an_epub(html, tmp_path, capsys):
    toc = tmp_path / "toc.yml"
    names = "{file: book/03_differentiation}, {file: book/api}, {file: book/labs}"
    toc.write_text(f"root: book/index\nparts: [{{caption: Some, chapters: [{names}]}}]\n", encoding="utf-8")
    with ThreadPoolExecutor(1) as apart:  # a thread has one Playwright, and the tests hold that of this one
        files = apart.submit(epub_book.book_files, html, toc, tmp_path, "full").result()
    pages = {name: ElementTree.fromstring(text) for name, text in files.items() if name.endswith(".xhtml")}
    formulas = [one for page in pages.values() for one in page.iter(MATH)]
    assert len(formulas) > 100 and all(one.get("alttext") and len(one) for one in formulas)
    assert not [name for name, page in pages.items() if r"\(" in "".join(page.itertext())], "TeX is left"
    images = [one for page in pages.values() for one in page.findall(".//{*}img")]
    assert len(images) > 10 and all(one.get("alt") and one.get("src") in files for one in images)
    assert not [one.tag for page in pages.values() for one in page.iter() if one.tag.endswith(("script", "spectral-lab", "button"))]
    epub_book.write_epub(files, tmp_path / "book.epub")
    found = epub_book.complaints(tmp_path / "book.epub")
    with capsys.disabled():
        print(f"\n{len(formulas)} formulas, {len(images)} pictures; " + ("EPUBCheck is not installed" if found is None else "checked"))
    assert not found
