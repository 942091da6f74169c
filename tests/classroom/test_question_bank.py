"""The question bank: its numbers are worked out, and both files hold them in the form that learning platforms read.

No package brings the schema of QTI 2.1, so what it demands of the elements used here is written out below: the order of
an element's children, and the attributes that must be there.
"""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pytest
import question_bank
from lxml import etree

ROOT = question_bank.ROOT
Written = tuple[list[question_bank.Question], Path]
Q = f"{{{question_bank.QTI}}}"
C = f"{{{question_bank.PACKAGE}}}"
# Of each element: its required attributes, and its children in their order (a regular expression of their names).
FORM = {
    "assessmentItem": ("identifier title adaptive timeDependent",
                       "responseDeclaration (outcomeDeclaration )+itemBody responseProcessing (modalFeedback )*"),
    "responseDeclaration": ("identifier cardinality baseType", "correctResponse "),
    "outcomeDeclaration": ("identifier cardinality baseType", "(defaultValue )?"),
    "correctResponse": ("", "value "), "defaultValue": ("", "value "), "value": ("", ""),
    "itemBody": ("", "(p p |choiceInteraction )"),
    "choiceInteraction": ("responseIdentifier shuffle maxChoices", "prompt (simpleChoice ){2,}"),
    "textEntryInteraction": ("responseIdentifier", ""), "simpleChoice": ("identifier", ""),
    "responseProcessing": ("", "responseCondition "), "responseCondition": ("", "responseIf (responseElseIf )*"),
    "responseIf": ("", "(match|equal) (setOutcomeValue )+"), "responseElseIf": ("", "(match|equal) setOutcomeValue "),
    "match": ("", "variable (correct|baseValue) "), "equal": ("toleranceMode tolerance", "variable (correct|baseValue) "),
    "variable": ("identifier", ""), "correct": ("identifier", ""), "baseValue": ("baseType", ""),
    "setOutcomeValue": ("identifier", "baseValue "), "modalFeedback": ("outcomeIdentifier showHide identifier", "p "),
    "p": ("", "((i|sub|sup|textEntryInteraction) )*"), "prompt": ("", "((i|sub|sup) )*"),
    "i": ("", "(sub )?"), "sub": ("", "(i )*"), "sup": ("", "(i )*"),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """Return the questions, and the folder in which both files lie."""
    folder = tmp_path_factory.mktemp("questions")
    return question_bank.write(folder), folder


def items(folder: Path) -> dict[str, etree._Element]:
    """Return the items of the package by name."""
    with zipfile.ZipFile(folder / "qti21.zip") as packed:
        return {name[:-4]: etree.fromstring(packed.read(name)) for name in packed.namelist() if name[0] == "q"}


def form_faults(item: etree._Element) -> list[str]:
    """Return what the form of an item lacks."""
    found = []
    for element in item.iter():
        name = etree.QName(element).localname
        attributes, children = FORM[name]
        found += [f"{name} lacks {one}" for one in attributes.split() if one not in element.attrib]
        inside = "".join(etree.QName(child).localname + " " for child in element)
        found += [] if re.fullmatch(children, inside) else [f"{name} holds {inside}"]
    return found


def graded(item: etree._Element, response: str) -> tuple[float, str]:
    """Return what a platform makes of a response: the score, and the words shown."""
    correct = item.findtext(f".//{Q}correctResponse/{Q}value")
    outcomes = {"SCORE": item.findtext(f".//{Q}outcomeDeclaration/{Q}defaultValue/{Q}value"), "FEEDBACK": ""}
    for case in item.find(f".//{Q}responseCondition"):
        test, *sets = case
        expected = correct if test[1].tag == Q + "correct" else test[1].text
        near = [float(side) for side in test.get("tolerance", "").split()]
        if (near and -near[0] <= float(response) - float(expected) <= near[1]) or (not near and response == expected):
            outcomes |= {one.get("identifier"): one[0].text for one in sets}
            break
    shown = item.find(f"{Q}modalFeedback[@identifier='{outcomes['FEEDBACK']}']")
    return float(outcomes["SCORE"]), "" if shown is None else "".join(shown.itertext()).strip()


def test_there_are_thirty_questions_and_each_is_made_from_an_exercise(written: Written) -> None:
    bank = written[0]
    texts = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "book").glob("*.ipynb"))
    assert len(bank) >= 30
    assert len({one.source for one in bank}) >= 25
    assert 5 <= sum(one.tolerance is None for one in bank) <= len(bank) - 15
    for one in bank:
        assert f":label: {one.source}\\n" in texts, one.source
        assert sum(answer.right for answer in one.answers) == 1, one.title
        assert len({answer.value for answer in one.answers}) == len(one.answers) >= 2
        assert all(answer.words for answer in one.answers if not answer.right), one.title


def test_no_slip_lies_within_the_tolerance_and_rounding_to_three_digits_does(written: Written) -> None:
    for one in written[0]:
        if one.tolerance is not None:
            right = next(float(answer.value) for answer in one.answers if answer.right)
            assert all(abs(float(a.value) - right) > 2 * one.tolerance for a in one.answers if not a.right), one.title
            assert abs(float(f"{right:.3g}") - right) <= one.tolerance, one.title


def test_the_file_for_moodle_holds_every_question_with_its_answers(written: Written) -> None:
    bank, folder = written
    category, *found = etree.parse(folder / "moodle.xml").getroot()
    assert category.get("type") == "category" and category.findtext("category/text").startswith("$course$/")
    assert len(found) == len(bank)
    for question, one in zip(found, bank, strict=True):
        assert question.get("type") == ("multichoice" if one.tolerance is None else "numerical")
        for needed in ("name/text", "questiontext[@format='html']/text", "generalfeedback/text", "defaultgrade", "penalty", "hidden"):
            assert question.find(needed) is not None, needed
        etree.fromstring(question.findtext("questiontext/text"))
        answers = question.findall("answer")
        assert [a.get("fraction") for a in answers] == ["100" if a.right else "0" for a in one.answers]
        for answer, own in zip(answers, one.answers, strict=True):
            assert (own.words in answer.findtext("feedback/text")) and answer.find("feedback").get("format") == "html"
            if one.tolerance is None:
                assert answer.findtext("text") == f"<p>{own.value}</p>" and question.findtext("single") == "true"
            else:
                assert float(answer.findtext("text")) == pytest.approx(own.value, rel=1e-9, abs=1e-12)
                assert float(answer.findtext("tolerance")) == pytest.approx(one.tolerance, rel=0.01)


def test_items_of_qti_have_their_form_and_reading_them_back_gives_the_answers(written: Written) -> None:
    bank, folder = written
    found = items(folder)
    assert sorted(found) == sorted(one.name for one in bank)
    for one in bank:
        item = found[one.name]
        assert item.tag == Q + "assessmentItem" and form_faults(item) == []
        for place, answer in enumerate(one.answers):
            response = f"A{place}" if one.tolerance is None else str(answer.value)
            assert graded(item, response) == (float(answer.right), answer.words), one.title
        if one.tolerance is not None:
            right = next(float(answer.value) for answer in one.answers if answer.right)
            assert graded(item, str(right + 0.9 * one.tolerance))[0] == 1
            assert graded(item, str(right + 1.1 * one.tolerance))[0] == 0
    item.find(f"{Q}itemBody").append(item.find(f"{Q}responseProcessing"))
    assert len(form_faults(item)) == 2


def test_the_package_lists_what_it_holds(written: Written) -> None:
    with zipfile.ZipFile(written[1] / "qti21.zip") as packed:
        manifest = etree.fromstring(packed.read("imsmanifest.xml"))
        files = set(packed.namelist())
    assert [etree.QName(child).localname for child in manifest] == ["metadata", "organizations", "resources"]
    assert manifest.findtext(f".//{C}schema") == "QTIv2.1 Package"
    resources = manifest.findall(f".//{C}resource")
    assert {one.get("type") for one in resources} == {"imsqti_item_xmlv2p1"}
    assert {one.get("href") for one in resources} | {"imsmanifest.xml"} == files
    assert all(one.find(f"{C}file").get("href") == one.get("href") for one in resources)

