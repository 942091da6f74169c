"""Verdicts in another language: tables made by `tools/translation.py`, chosen by SPECTRAL_NOTES_LANGUAGE."""

from __future__ import annotations

import functools
import json
import os
import re
from importlib.resources import files

PLACE = "{}"


def translated(text: str) -> str:
    """Return a text in the language that the environment names, values and all; itself where there is no translation.

    >>> os.environ["SPECTRAL_NOTES_LANGUAGE"] = "de"
    >>> translated("Your number is 3. Is its sign turned?")
    'Ihre Zahl ist 3. Ist das Vorzeichen verkehrt?'
    >>> del os.environ["SPECTRAL_NOTES_LANGUAGE"]
    """
    for pattern, translation in _table(os.environ.get("SPECTRAL_NOTES_LANGUAGE", "")):
        if found := pattern.fullmatch(text.lstrip()):
            blank = text[: len(text) - len(text.lstrip())]
            return blank + translation.format(*map(translated, found.groups()))
    return text


@functools.cache
def _table(language: str) -> list[tuple[re.Pattern[str], str]]:
    """Return the texts of a language as patterns, those with most words of their own first."""
    file = files("spectral_notes.checking") / "data" / f"{language}.json"
    if not re.fullmatch("[a-z]{2,3}(_[A-Z]{2})?", language) or not file.is_file():
        return []
    texts = [(text.lstrip(), words.lstrip()) for text, words in json.loads(file.read_text(encoding="utf-8")).items()]
    ordered = sorted(texts, key=lambda pair: -len(pair[0].replace(PLACE, "")))
    return [(re.compile(re.escape(text).replace(r"\{\}", "(.*?)"), re.DOTALL), words) for text, words in ordered]
