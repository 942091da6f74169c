"""Make an EPUB of the built book: its pages, MathML for the formulas, pictures with alternative texts, no scripts.

    python tools/epub_book.py _build/html --into _build/html/_downloads --edition full

The pages are those that `print_book` prints: folded code is left away, the labs are their stills, solutions stand apart
at the end. EPUBCheck says whether the file is one, where it is installed (Debian: `epubcheck`).
"""

from __future__ import annotations

import html
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import uuid
import zipfile
from collections.abc import Iterable
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

import downloads
from bs4 import BeautifulSoup, NavigableString, Tag
from print_book import TITLE, article, chapters, started_browser
from pygments.formatters import HtmlFormatter

AUTHOR = "The Spectral Geometry Notes authors"
KEPT = {"alt", "class", "colspan", "href", "id", "rowspan", "src", "start"}
TYPES = {".jpg": "image/jpeg", ".svg": "image/svg+xml", ".css": "text/css", ".xhtml": "application/xhtml+xml"}
# Where MathJax notes its own affairs.
NOTES = re.compile(r'\s(?:data-[\w-]+|class)="[^"]*"')

STYLE = """
body { line-height: 1.45; }
h1, h2, h3, h4 { font-family: sans-serif; line-height: 1.25; }
pre { background: #f6f6f6; color: #000; font-size: 0.8em; padding: 0.5em; white-space: pre-wrap; }
code, pre { font-family: monospace; overflow-wrap: anywhere; }
.cell_output pre { background: #fff; border: 1px solid #ddd; }
figure { margin: 1em 0; } figcaption { font-size: 0.9em; }
img { height: auto; max-width: 100%; }
table { border-collapse: collapse; font-size: 0.9em; }
th, td { border-bottom: 1px solid #ccc; padding: 0.2em 0.5em; text-align: left; vertical-align: top; }
div.math { overflow-x: auto; } .eqno { float: right; }
.admonition { border-left: 0.25em solid #7a96bd; margin: 1em 0; padding: 0 0.8em; }
.admonition-title { font-family: sans-serif; font-weight: bold; }
"""

PAGE = """<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE html>
<html xmlns="http://www.w3.org/1999/xhtml" xmlns:epub="http://www.idpf.org/2007/ops" lang="en" xml:lang="en">
<head><title>{title}</title><link rel="stylesheet" type="text/css" href="style.css"/></head>
<body>{body}</body></html>
"""
CONTAINER = """<?xml version="1.0"?>
<container version="1.0" xmlns="urn:oasis:names:tc:opendocument:xmlns:container"><rootfiles>
<rootfile full-path="book/package.opf" media-type="application/oebps-package+xml"/></rootfiles></container>
"""
PACKAGE = """<?xml version="1.0" encoding="utf-8"?>
<package xmlns="http://www.idpf.org/2007/opf" version="3.0" unique-identifier="name" xml:lang="en">
<metadata xmlns:dc="http://purl.org/dc/elements/1.1/">
<dc:identifier id="name">urn:uuid:{name}</dc:identifier><dc:title>{title}</dc:title><dc:language>en</dc:language>
<dc:creator>{author}</dc:creator><dc:rights>Text CC BY 4.0, code BSD 3-Clause</dc:rights>
<meta property="dcterms:modified">{modified}</meta>
<meta property="schema:accessMode">textual</meta><meta property="schema:accessMode">visual</meta>
<meta property="schema:accessibilityFeature">alternativeText</meta>
<meta property="schema:accessibilityFeature">MathML</meta>
<meta property="schema:accessibilityFeature">tableOfContents</meta>
<meta property="schema:accessibilityHazard">none</meta>
<meta property="schema:accessibilitySummary">Figures have alternative texts, formulas are MathML.</meta>
</metadata>
<manifest>
{items}
</manifest>
<spine>{spine}</spine>
</package>
"""


def formulas_of(tags: Iterable[Tag]) -> list[tuple[Tag, tuple[str, bool]]]:
    """Return the places of formulas, each with its TeX and whether it is displayed; its number stays in its place."""
    found = []  # no dict: places with equal content are equal to Beautiful Soup
    for place in (place for tag in tags for place in tag.select(".math")):
        text = "".join(child for child in place.contents if isinstance(child, NavigableString)).strip()
        found.append((place, (text[2:-2].strip(), text.startswith(r"\["))))
    return found


def mathml(formulas: Iterable[tuple[str, bool]], script: Path) -> dict[tuple[str, bool], str]:
    """Return the MathML of formulas (TeX, displayed), by the MathJax of the book."""
    asked = list(dict.fromkeys(formulas))
    with started_browser() as page, tempfile.TemporaryDirectory() as folder:
        blank = Path(folder) / "blank.html"
        blank.write_text(f'<script src="{script.as_uri()}"></script>', encoding="utf-8")
        page.goto(blank.as_uri(), wait_until="load")
        page.wait_for_function("Boolean(window.MathJax?.tex2mml)")
        code = "(all) => all.map(([tex, display]) => MathJax.tex2mml(tex, { display }))"
        made = page.evaluate(code, [list(one) for one in asked])
    for (tex, _), text in zip(asked, made, strict=True):
        if "<merror" in text:
            raise ValueError(f"MathJax must read every formula; it does not read {tex!r}")
    return {
        one: NOTES.sub("", text).replace("<math", f'<math alttext="{html.escape(one[0])}"', 1)
        for one, text in zip(asked, made, strict=True)
    }


def cleaned(tag: Tag) -> None:
    """Make a part of a page XHTML without scripts: elements and attributes that every reader of EPUBs knows."""
    for one in tag.select("spectral-lab, picture"):
        one.unwrap()
    for one in [tag, *tag.find_all(True)]:
        one.attrs = {name: value for name, value in one.attrs.items() if name in KEPT}
    for one in tag.select("p:has(ul, ol, dl, div, table, pre)"):
        one.name = "div"


def book_files(root: Path, toc: Path, pictures: Path, name: str) -> dict[str, str | Path]:
    """Return the files of the EPUB of this name, text or the path of a picture; pictures are made in a folder."""
    bodies: dict[str, list[Tag]] = {}
    titles, parts, answers = {"solutions": "Solutions"}, [], []
    for caption, pages in chapters(toc):
        parts.append((caption, [Path(page).stem for page in pages]))
        for page in pages:
            body, solutions, title = article(root, page, pictures)
            bodies[Path(page).stem], titles[Path(page).stem] = [body], title
            if solutions:
                head = BeautifulSoup(f"<h2>{html.escape(title)}</h2>", "html.parser")
                answers += [head.h2, *solutions]
    if answers:
        bodies["solutions"] = [BeautifulSoup("<h1>Solutions</h1>", "html.parser").h1, *answers]
        parts.append(("", ["solutions"]))
    formulas = [found for tags in bodies.values() for found in formulas_of(tags)]
    made = mathml((one for _, one in formulas), root / "_static" / "mathjax" / "tex-chtml-full.js")
    for tag in (tag for tags in bodies.values() for tag in tags):
        cleaned(tag)
    for place, one in formulas:
        for child in [child for child in place.contents if isinstance(child, NavigableString)]:
            child.extract()
        place.append(BeautifulSoup(made[one], "html.parser"))
    files = linked(bodies)
    texts: dict[str, str | Path] = {
        f"{stem}.xhtml": PAGE.format(title=html.escape(titles[stem]), body="".join(map(str, tags)))
        for stem, tags in bodies.items()
    }
    code = HtmlFormatter(style="a11y-high-contrast-light").get_style_defs(".highlight")
    lists = "".join(contents(caption, stems, titles) for caption, stems in parts)
    nav = f'<nav epub:type="toc" id="toc"><h1>Contents</h1><ol>{lists}</ol></nav>'
    texts |= files | {"style.css": STYLE + code, "nav.xhtml": PAGE.format(title="Contents", body=nav)}
    return texts | {"package.opf": package(texts, [stem for _, stems in parts for stem in stems], name)}


def linked(bodies: dict[str, list[Tag]]) -> dict[str, str | Path]:
    """Let links of the parts lead to each other's files, and return the pictures by their new names."""
    tags = [(stem, tag) for stem, several in bodies.items() for tag in several]
    homes: dict[str, str] = {}
    for stem, top in tags:
        for one in [top, *top.select("[id]")]:
            if one.get("id") in homes:
                del one["id"]  # boxes of exercises call their inside by one name
            elif one.get("id"):
                homes[str(one["id"])] = stem
    pictures: dict[str, str | Path] = {}
    for _, top in tags:
        for link in top.select("a[href^='#']"):
            name = str(link["href"])[1:]
            if name in homes:
                link["href"] = f"{homes[name]}.xhtml#{name}"
            else:
                del link["href"]
        for link in top.select("a[href^='http']"):
            link["href"] = quote(str(link["href"]), safe="%/:?#[]@!$&'()*+,;=~")  # an old DOI holds < and >
        for image in top.select("img[src]"):
            source = Path(unquote(urlsplit(str(image["src"])).path))
            image["src"] = name = f"images/{source.name}"
            pictures[name] = drawing(source) if source.suffix == ".svg" else source
    return pictures


def drawing(source: Path) -> str:
    """Return a drawing as EPUBs want it: no document type, which lies on another host, and no path without a way."""
    text = re.sub(r"<!DOCTYPE[^>]*>", "", source.read_text(encoding="utf-8"))
    return re.sub(r'<path(?![^>]*\sd=)([^>]*?)/>', r'<path d="M0 0"\1/>', text)


def contents(caption: str, stems: list[str], titles: dict[str, str]) -> str:
    """Return the lines of one part of the contents."""
    lines = "".join(f'<li><a href="{stem}.xhtml">{html.escape(titles[stem])}</a></li>' for stem in stems)
    return f"<li><span>{html.escape(caption)}</span><ol>{lines}</ol></li>" if caption else lines


def package(files: dict[str, str | Path], order: list[str], name: str) -> str:
    """Return the list of what the EPUB holds and in which order it is read."""
    items = []
    for name, text in files.items():
        marks = ["nav"] * (name == "nav.xhtml") + ["mathml"] * (isinstance(text, str) and "<math" in text)
        marked = f' properties="{" ".join(marks)}"' if marks else ""
        items.append(f'<item id="{key(name)}" href="{name}" media-type="{TYPES[Path(name).suffix]}"{marked}/>')
    names = ["nav.xhtml", *(f"{stem}.xhtml" for stem in order)]
    now = time.gmtime(int(os.environ.get("SOURCE_DATE_EPOCH", time.time())))
    return PACKAGE.format(
        name=uuid.uuid5(uuid.NAMESPACE_URL, name),
        title=html.escape(TITLE),
        author=html.escape(AUTHOR),
        modified=time.strftime("%Y-%m-%dT%H:%M:%SZ", now),
        items="\n".join(items),
        spine="".join(f'<itemref idref="{key(name)}"/>' for name in names),
    )


def key(name: str) -> str:
    """Return the name of a file as a word of XML."""
    return "f-" + re.sub(r"[^\w-]", "-", name)


def write_epub(files: dict[str, str | Path], target: Path) -> None:
    """Write the files into an EPUB; its first says what it is."""
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as epub:
        epub.writestr("mimetype", "application/epub+zip", zipfile.ZIP_STORED)
        epub.writestr("META-INF/container.xml", CONTAINER)
        for name, content in files.items():
            if isinstance(content, Path):
                epub.write(content, f"book/{name}")
            else:
                epub.writestr(f"book/{name}", content)


def complaints(path: Path) -> list[str] | None:
    """Return the errors and warnings that EPUBCheck finds; None where it is not installed."""
    command = shutil.which("epubcheck")
    if command is None:
        return None
    archive = os.path.realpath(command)  # Debian's command is a link to an archive of Java
    call = ["java", "-jar", archive] if archive.endswith(".jar") else [command]
    ran = subprocess.run([*call, str(path)], capture_output=True, text=True, check=False)
    found = [line for line in (ran.stdout + ran.stderr).splitlines() if re.match(r"(FATAL|ERROR|WARNING)", line)]
    return found or ([ran.stderr.strip() or f"EPUBCheck ended with {ran.returncode}"] if ran.returncode else [])


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    root, target, toc = downloads.command_line(__doc__ or "", ".epub", arguments)
    with tempfile.TemporaryDirectory() as folder:
        files = book_files(root, toc, Path(folder), target.stem)
        made = Path(folder) / "book.epub"
        write_epub(files, made)
        shutil.copyfile(made, target)
    found = complaints(target)
    said = "not checked, as epubcheck is not installed" if found is None else f"{len(found)} complaints of EPUBCheck"
    pages = sum(name.endswith(".xhtml") for name in files)
    print(f"{target.name}: {pages} pages, {target.stat().st_size / 1e6:.1f} MB, {said}")
    for line in found or []:
        sys.stderr.write(f"{line}\n")
    downloads.offer(root)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
