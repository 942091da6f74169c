"""Write the question bank for learning platforms: Moodle XML, and a package of QTI 2.1.

    python tools/question_bank.py course/teacher/questions

The questions stand in `classroom/questions.yaml`. Every number is worked out here, by the code beside its question.
"""

from __future__ import annotations

import importlib
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.optimize
import yaml
from lxml import etree
from lxml.builder import ElementMaker

from spectral_notes.files import write_whole

ROOT = Path(__file__).resolve().parents[1]
QUESTIONS = ROOT / "classroom" / "questions.yaml"
CATEGORY = "$course$/Spectral Geometry Notes"
TOPICS = ("eigenbasis", "finite_differences", "geometry", "graphs", "laplacians", "meshes", "shapes", "signals")
QTI = "http://www.imsglobal.org/xsd/imsqti_v2p1"
PACKAGE = "http://www.imsglobal.org/xsd/imscp_v1p1"
XML_LANG = "{http://www.w3.org/XML/1998/namespace}lang"


@dataclass(frozen=True)
class Answer:
    """An answer: a number or a text, whether it is right, and what to say of it."""

    value: float | str
    right: bool
    words: str


@dataclass(frozen=True)
class Question:
    """A question whose numbers are worked out; to be typed in within `tolerance`, or, without one, to be chosen."""

    name: str
    source: str
    title: str
    text: str
    answers: tuple[Answer, ...]
    tolerance: float | None


def worked_out(entry: dict[str, Any], number: int) -> Question:
    """Return a question of the file with its numbers worked out."""
    names = {"np": np, "scipy": scipy} | {n: importlib.import_module(f"spectral_notes.{n}") for n in TOPICS}
    exec(entry.get("given", ""), names)

    def value(code: object) -> float:
        return round(float(eval(str(code), names)), 12) + 0.0

    tolerance = None
    if "options" in entry:
        answers = [Answer(one["say"], bool(eval(one["holds"], names)), one["because"]) for one in entry["options"]]
    else:
        right = value(entry["answer"])
        slips = [(value(code), words) for code, words in entry["slips"].items()]
        if entry.get("choose"):
            spelt = [(f"{number:.3g}".replace("-", "−"), words) for number, words in [(right, ""), *slips]]
            answers = [Answer(text, place == 0, words) for place, (text, words) in enumerate(spelt)]
        else:
            tolerance = entry.get("within", 0.01) * (abs(right) or 1.0)
            answers = [Answer(right, True, ""), *(Answer(one, False, words) for one, words in slips)]
    return Question(f"q{number:02d}", entry["from"], entry["title"], entry["text"], tuple(answers), tolerance)


def questions(path: Path = QUESTIONS) -> list[Question]:
    """Return all questions of a file."""
    entries = yaml.safe_load(path.read_text(encoding="utf-8"))
    return [worked_out(entry, number) for number, entry in enumerate(entries, start=1)]


def moodle(bank: list[Question]) -> bytes:
    """Return the questions as Moodle XML."""
    E = ElementMaker()

    def html(tag: str, text: str, **given: str) -> Any:
        return E(tag, E.text(etree.CDATA(f"<p>{text}</p>" if text else "")), format="html", **given)

    quiz = E.quiz(E.question(E.category(E.text(CATEGORY)), type="category"))
    for one in bank:
        chosen = one.tolerance is None
        question = E.question(
            E.name(E.text(f"{one.name} {one.title}")),
            html("questiontext", one.text),
            E.generalfeedback(E.text(""), format="html"),
            E.defaultgrade("1"),
            E.penalty("0.3333333"),
            E.hidden("0"),
            E.idnumber(f"{one.source}-{one.name}"),
            type="multichoice" if chosen else "numerical",
        )
        if chosen:
            question.extend([E.single("true"), E.shuffleanswers("true"), E.answernumbering("none")])
        for answer in one.answers:
            value = etree.CDATA(f"<p>{answer.value}</p>") if chosen else f"{answer.value:.12g}"
            form = "html" if chosen else "moodle_auto_format"
            made = E.answer(E.text(value), fraction="100" if answer.right else "0", format=form)
            made.append(html("feedback", answer.words))
            made.extend([] if chosen else [E.tolerance(f"{one.tolerance:.3g}")])
            question.append(made)
        quiz.append(question)
    return etree.tostring(quiz, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def item(one: Question) -> bytes:
    """Return a question as an item of QTI 2.1."""
    E = ElementMaker(namespace=QTI, nsmap={None: QTI})
    chosen = one.tolerance is None
    kind = "identifier" if chosen else "float"
    names = [f"A{place}" for place in range(len(one.answers))]
    right = next(place for place, answer in enumerate(one.answers) if answer.right)

    def spelt(place: int) -> str:
        return names[place] if chosen else f"{one.answers[place].value:.12g}"

    def html(tag: str, text: str, **given: str) -> Any:
        return etree.fromstring(f'<{tag} xmlns="{QTI}">{text}</{tag}>')

    def is_it(place: int) -> Any:
        other = E.correct(identifier="RESPONSE") if place == right else E.baseValue(spelt(place), baseType=kind)
        pair = (E.variable(identifier="RESPONSE"), other)
        near = f"{one.tolerance:.3g}" if not chosen else ""
        return E.match(*pair) if chosen else E.equal(*pair, toleranceMode="absolute", tolerance=f"{near} {near}")

    def outcome(name: str, value: str, base: str) -> Any:
        return E.setOutcomeValue(E.baseValue(value, baseType=base), identifier=name)

    order = [right, *(place for place in range(len(names)) if place != right)]
    cases = []
    for place in order:
        tag = E.responseIf if place == right else E.responseElseIf
        score = [outcome("SCORE", "1", "float")] if place == right else []
        cases.append(tag(is_it(place), *score, outcome("FEEDBACK", names[place], "identifier")))
    if chosen:
        choices = [E.simpleChoice(str(a.value), identifier=n) for n, a in zip(names, one.answers, strict=True)]
        given = {"responseIdentifier": "RESPONSE", "shuffle": "true", "maxChoices": "1"}
        asked = [E.choiceInteraction(html("prompt", one.text), *choices, **given)]
    else:
        entry = E.textEntryInteraction(responseIdentifier="RESPONSE", expectedLength="12")
        asked = [html("p", one.text), E.p(entry)]
    made = E.assessmentItem(
        E.responseDeclaration(
            E.correctResponse(E.value(spelt(right))), identifier="RESPONSE", cardinality="single", baseType=kind
        ),
        E.outcomeDeclaration(E.defaultValue(E.value("0")), identifier="SCORE", cardinality="single", baseType="float"),
        E.outcomeDeclaration(identifier="FEEDBACK", cardinality="single", baseType="identifier"),
        E.itemBody(*asked),
        E.responseProcessing(E.responseCondition(*cases)),
        *(
            E.modalFeedback(E.p(answer.words), outcomeIdentifier="FEEDBACK", showHide="show", identifier=name)
            for name, answer in zip(names, one.answers, strict=True)
            if answer.words
        ),
        identifier=one.name,
        title=one.title,
        adaptive="false",
        timeDependent="false",
    )
    made.set(XML_LANG, "en")
    return etree.tostring(made, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def manifest(bank: list[Question]) -> bytes:
    """Return the list of the contents of a package."""
    E = ElementMaker(namespace=PACKAGE, nsmap={None: PACKAGE})
    resources = [
        E.resource(
            E.file(href=f"{q.name}.xml"), identifier=f"r-{q.name}", type="imsqti_item_xmlv2p1", href=f"{q.name}.xml"
        )
        for q in bank
    ]
    made = E.manifest(
        E.metadata(E.schema("QTIv2.1 Package"), E.schemaversion("1.0.0")),
        E.organizations(),
        E.resources(*resources),
        identifier="spectral-geometry-notes",
    )
    return etree.tostring(made, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def write(folder: Path) -> list[Question]:
    """Write both files into a folder, and return the questions."""
    bank = questions()
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / "moodle.xml", lambda place: place.write_bytes(moodle(bank)))

    def pack(place: Path) -> None:
        with zipfile.ZipFile(place, "w", zipfile.ZIP_DEFLATED) as packed:
            for name, data in [("imsmanifest.xml", manifest(bank)), *((f"{q.name}.xml", item(q)) for q in bank)]:
                packed.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data)

    write_whole(folder / "qti21.zip", pack)
    return bank


if __name__ == "__main__":
    sys.stderr.write(f"{len(write(Path(sys.argv[1])))} questions, as moodle.xml and qti21.zip in {sys.argv[1]}\n")
