"""Verdicts in another language: values stay, what is not translated stays English, and the tables fit the code."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
import scipy.sparse as sp
import translation

from spectral_notes.checking import check_laplacian, check_number
from spectral_notes.checking.languages import translated

PATH = np.diag([1.0, 2, 1]) - np.eye(3, k=1) - np.eye(3, k=-1)


@pytest.fixture
def german(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask for German."""
    monkeypatch.setenv("SPECTRAL_NOTES_LANGUAGE", "de")


@pytest.mark.usefixtures("german")
def test_a_verdict_is_german_with_its_values_and_its_guess() -> None:
    verdict = check_laplacian(PATH - np.diag(np.diag(PATH)), sp.csr_array(PATH))
    assert str(verdict).startswith("Nicht richtig. Die Zeilen haben nicht die Summe null (größte -2, Zeile 1): Fehlt die Diagonale?")
    assert verdict._repr_markdown_().startswith("**Nicht richtig.** Die Zeilen")
    assert str(check_number(-2.0, 2.0)).splitlines()[0] == "Nicht richtig. Ihre Zahl ist -2. Ist das Vorzeichen verkehrt?"
    assert str(check_number(..., 2.0)).startswith("Noch nicht versucht. Ersetzen Sie")
    assert "The law" not in str(check_number(1.0, 2.0, law="a law of this page")) and "a law of this page" in str(check_number(1.0, 2.0, law="a law of this page"))


@pytest.mark.parametrize("language", ["", "xx", "../de", "de.json"])
def test_without_a_table_verdicts_are_english(monkeypatch: pytest.MonkeyPatch, language: str) -> None:
    monkeypatch.setenv("SPECTRAL_NOTES_LANGUAGE", language)
    assert str(check_number(2.0, 2.0)) == "Right. The number is right."


@pytest.mark.usefixtures("german")
def test_values_of_a_text_are_not_read_as_places() -> None:
    assert translated("It raises KeyError: '{0} {}'") == "Sie löst KeyError aus: '{0} {}'"


def test_catalogue_and_table_fit_the_code() -> None:
    table = json.loads((translation.CHECKING / "data" / "de.json").read_text(encoding="utf-8"))
    catalogue = translation.read(translation.PLACE / "de" / "LC_MESSAGES" / "verdicts.po", "de")
    assert {message.id for message in catalogue if message.id} == {message.id for message in translation.verdict_texts() if message.id}
    assert table == {message.id: message.string for message in catalogue if message.id and message.string}
    assert len(table) >= 140
    for text, words in table.items():
        assert text.count("{}") == words.count("{}"), text
        assert not re.search(r"[{}]", words.replace("{}", "")), words
