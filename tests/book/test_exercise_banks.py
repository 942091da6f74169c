"""A bank for every check of every exercise, made from the check itself: plausible slips it refuses, right forms it takes.

The right answers are read off the check as it runs. The slips are those that students make anywhere: a sign, a factor,
an order, an offset, a share for a percentage, a name of the set-up, the answer to the neighbouring exercise. A check
whose right answer cannot be read off stands in `exercise_answers.WRONG` with slips of its own.
"""

from __future__ import annotations

import ast
import contextlib
import io
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import exercises
import numpy as np
import pytest
import scipy.sparse as sp
from exercise_answers import SETTING, WRONG
from test_exercises import CHECKS, PARTS, given_cells, imports_of, reads

from spectral_notes import checking
from spectral_notes.checking.verdicts import unseal

SOLVED = {"check_number", "check_values", "check_choice", "check_function", "check_labels"}  # hold their right answer


@dataclass(frozen=True)
class Call:
    """One verdict of a check: the name it judges, the function that does, and what it is given beside the answer."""

    name: str
    kind: str
    more: tuple[Any, ...]
    options: dict[str, Any]


@lru_cache
def context(label: str) -> dict[str, Any]:
    """The names that an exercise starts with: imports, its cells before the answer, and its placeholders."""
    names: dict[str, Any] = {}
    path, exercise = PARTS[label]
    given = [SETTING.get(label, ""), given_cells(label)] if reads(label) or label in SETTING else []
    with contextlib.redirect_stdout(io.StringIO()):
        for source in [imports_of(path), *given, *(cell.source for cell in exercise.answers)]:
            exec(source, names)
    return names


def run(label: str, answers: dict[str, Any], record: list[Call] | None = None) -> list[str]:
    """What the check says line by line, after the answers; its calls are appended to `record`."""
    names = {**context(label), **answers}
    judged = [ast.unparse(node.args[0]) for node in ast.walk(ast.parse(CHECKS[label]))
              if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id.startswith("check_")]
    if record is not None:
        for kind in (name for name in checking.__all__ if name.startswith("check_")):

            def keep(answer: object, *more: Any, kind: str = kind, **options: Any) -> Any:
                record.append(Call(judged[len(record)] if len(record) < len(judged) else "", kind, more, options))
                return getattr(checking, kind)(answer, *more, **options)

            names[kind] = keep
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        exec(CHECKS[label], names)
    return [line for line in told.getvalue().splitlines() if line.startswith(("Right.", "Not "))]


@lru_cache
def calls(label: str) -> tuple[Call, ...]:
    """The verdicts of a check that hold their right answer."""
    record: list[Call] = []
    run(label, {}, record)
    return tuple(record)


def right_answer(call: Call) -> Any:
    """A right answer to one call; a function plays the sealed values back in the order of its inputs."""
    wanted = unseal(call.more[0])
    if call.kind != "check_function" or callable(wanted):
        return wanted
    return lambda *given: wanted[[repr(i) for i in call.more[1]].index(repr(tuple(given)))]


def readable(call: Call) -> bool:
    """Say whether the right answer can be read off."""
    return call.kind in SOLVED and call.name.startswith("my_") and call.options.get("through") is None


def slips(call: Call) -> list[Any]:
    """Wrong answers to one call: none is right by the call's own tolerance."""
    wanted = right_answer(call)
    if call.kind == "check_number":
        value = float(wanted)
        near = call.options.get("within") or 1e-3 * abs(value) or 1e-9
        tries = [-value, 2 * value, value / 2, value + 1, value - 1, 100 * value, value + 3 * near, 1 / value if value else 7.0]
        return [number for number in tries if not checking.check_number(number, *call.more, **call.options)]
    if call.kind == "check_values":
        value = np.asarray(wanted) * 1
        unit = abs(value).max(initial=0.0) or 1.0
        other = value + np.where(np.arange(value.size).reshape(value.shape) == 0, unit, 0)
        tries = [other, value[:-1] if value.ndim else value, value + unit, unit - value, np.full(value.shape, np.nan)]
        tries += [2 * value if value.any() else value + 1, value[::-1] if value.ndim else -value]
        return [array for array in tries if not checking.check_values(array, *call.more, **call.options)]
    if call.kind == "check_choice":
        if isinstance(wanted, bool):
            return [not wanted, str(not wanted).lower(), "perhaps"]
        words = wanted if isinstance(wanted, list) else [wanted]
        return [[*words, "umbrella"], words[1:] or "umbrella", "umbrella", not words]
    if call.kind == "check_labels":
        return [np.zeros(len(wanted)), np.arange(len(wanted)), np.random.default_rng(0).permutation(wanted)]
    return [lambda *given: 0 * np.asarray(wanted_of(call, given)), lambda *given: 2 * np.asarray(wanted_of(call, given)) + 1,
            lambda *given: "words"]


def wanted_of(call: Call, given: tuple[Any, ...]) -> Any:
    """What a right function returns."""
    return right_answer(call)(*given)


def right_forms(call: Call) -> list[Any]:
    """The right answer as others would write it."""
    wanted = right_answer(call)
    if call.kind == "check_number":
        return [np.array([float(wanted)]), np.float64(wanted), [float(wanted)]]
    if call.kind == "check_values":
        value = np.asarray(wanted) * 1
        forms: list[Any] = [value.tolist(), value + 0j if np.iscomplexobj(value) else value.astype(float)]
        forms += [value[:, None], value[None, :]] if value.ndim == 1 else []
        return forms + ([sp.csr_array(value)] if value.ndim == 2 else []) + ([-value] if call.options.get("either_sign") else [])
    if call.kind == "check_choice":
        if isinstance(wanted, bool):
            return [str(wanted), "yes" if wanted else "no", int(wanted), np.bool_(wanted)]
        words = wanted if isinstance(wanted, list) else [wanted]
        return [[f" {word} ".upper() for word in reversed(words)], set(map(str, words))]
    if call.kind == "check_labels":
        return [[f"part {label}" for label in wanted]]
    return [lambda *given: np.asarray(wanted_of(call, given)).tolist()]


def answers_of(label: str) -> dict[str, Any]:
    """The right answers to all calls of an exercise that can be read off."""
    return {call.name: right_answer(call) for call in calls(label) if readable(call)}


each_label = pytest.mark.parametrize("label", CHECKS)


@each_label
def test_every_check_has_a_bank(label: str) -> None:
    by_hand = [case for case in WRONG if case[0] == label]
    for call in calls(label):
        assert len(slips(call)) >= 3 if readable(call) else by_hand, f"{call.name} of {label} has no wrong answers"


@each_label
def test_a_check_takes_every_right_form(label: str) -> None:
    for n, call in enumerate(calls(label)):
        for form in [right_answer(call), *right_forms(call)] if readable(call) else ():
            told = run(label, {**answers_of(label), call.name: form})
            assert told[n].startswith("Right."), (call.name, form, told[n])


@each_label
def test_a_check_refuses_slips_and_the_start(label: str) -> None:
    for n, call in enumerate(calls(label)):
        for slip in slips(call) if readable(call) else ():
            told = run(label, {**answers_of(label), call.name: slip})
            assert told[n].startswith("Not right."), (call.name, slip, told[n])
    assert all(line.startswith("Not attempted yet.") for line in run(label, {}))


@pytest.mark.parametrize(("label", "other"), list(pairwise(CHECKS)))
def test_a_check_refuses_its_neighbours_answer(label: str, other: str) -> None:
    for n, call in enumerate(calls(label)):
        for neighbour in calls(other) if readable(call) else ():
            if readable(neighbour) and neighbour.kind == call.kind != "check_choice" and not same(call, neighbour):
                told = run(label, {**answers_of(label), call.name: right_answer(neighbour)})
                assert told[n].startswith("Not right."), (call.name, neighbour, told[n])


def same(call: Call, neighbour: Call) -> bool:
    """Say whether two exercises happen to have one answer."""
    judge: Callable[..., checking.Verdict] = getattr(checking, call.kind)
    return bool(judge(right_answer(neighbour), *call.more, **call.options))


@pytest.mark.parametrize("label", [label for label in CHECKS if reads(label) or label in SETTING])
def test_a_check_refuses_what_the_exercise_gives(label: str) -> None:
    for n, call in enumerate(calls(label)):
        if readable(call) and call.kind in {"check_number", "check_values", "check_labels"}:
            for name in exercises.names_set(given_cells(label)) & set(context(label)):
                value = context(label)[name]
                if isinstance(value, float | int | np.ndarray):
                    told = run(label, {**answers_of(label), call.name: value})
                    assert told[n].startswith("Not right."), (call.name, name, told[n])
