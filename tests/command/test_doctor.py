"""The doctor: a sound set-up is called sound, and each thing broken on purpose is found, named, and given a remedy."""

from __future__ import annotations

import importlib.metadata
import json
import subprocess
from types import SimpleNamespace

import numpy as np
import pytest

from spectral_notes import eigenbasis
from spectral_notes.command import doctor
from spectral_notes.command.cli import main
from spectral_notes.command.doctor import examine
from spectral_notes.solver import factorization


def test_this_set_up_works_and_the_command_says_so(capsys):
    assert main(["doctor", "--vertices", "10000", "-k", "50", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert "50 modes of 10,000 vertices need" in facts["findings"][-1]["says"]
    assert facts["works"]
    names = [finding["name"] for finding in facts["findings"]]
    assert names[:5] == ["python", "packages", "optional packages", "linear algebra", "eigenproblem"]
    assert names[5:] == ["pictures", "interactive scenes", "files", "memory"]
    assert "drawn by" in facts["findings"][5]["says"]


def test_what_raises_is_a_finding_with_its_remedy_and_code_1(monkeypatch, capsys):
    def fail():
        raise ImportError("libigl.so:\nno such file")

    for name in ("check_eigenproblem", "check_pictures", "check_files"):
        monkeypatch.setattr(doctor, name, fail)
    broken = [finding for finding in examine() if finding.status == "broken"]
    assert [finding.name for finding in broken] == ["eigenproblem", "pictures", "files"]
    assert broken[0].says == "ImportError: libigl.so: no such file"
    assert all(finding.remedy for finding in broken)
    assert main(["doctor"]) == 1
    said = capsys.readouterr().out
    assert said.splitlines()[-1] == "broken: eigenproblem, pictures, files"
    assert "sudo apt-get install libegl1" in said
    monkeypatch.setattr(doctor, "examine", lambda *_: [doctor.Finding("python", "ok", "3.12")])
    assert main(["doctor"]) == 0
    assert capsys.readouterr().out == "ok     python: 3.12\nthe set-up works\n"


def test_a_python_or_a_package_that_is_too_old(monkeypatch):
    monkeypatch.setattr(doctor.platform, "python_version", lambda: "3.9.1")
    found = doctor.check_python()
    assert (found.status, found.says) == ("broken", "3.9.1, and <3.15,>=3.11 is needed")
    monkeypatch.setattr(
        importlib.metadata, "requires", lambda _: ["numpy>=999", "no-such-thing>=1", "jax; extra == 'x'"]
    )
    found = doctor.check_packages()
    assert found.status == "broken"
    assert "and >=999 is needed; no-such-thing is not installed" in found.says
    assert found.remedy == doctor.INSTALL


def test_optional_packages_are_a_note(monkeypatch):
    monkeypatch.setattr(doctor, "find_spec", lambda name: None if name == "jupyterlab" else object())
    found = doctor.check_optional_packages()
    assert (found.status, found.says) == ("note", "not installed: jupyterlab")
    assert "to run the notebooks" in found.remedy


def test_wrong_eigenvalues_and_a_slow_solver_are_found(monkeypatch):
    compute = eigenbasis.compute_eigenbasis

    def skewed(L, M, k):
        basis = compute(L, M, k)
        return SimpleNamespace(evals=1.05 * basis.evals, orthonormality_error=basis.orthonormality_error)

    monkeypatch.setattr(doctor, "compute_eigenbasis", skewed)
    found = doctor.check_eigenproblem()
    assert found.status == "broken"
    assert "off by" in found.says
    monkeypatch.undo()
    monkeypatch.setattr(doctor, "SLOW", 0.0)
    found = doctor.check_eigenproblem()
    assert found.status == "note"
    assert "the machine may have been busy: try again" in found.remedy


@pytest.mark.parametrize("installed", [True, False])
def test_the_factor_in_use_is_said(monkeypatch, installed):
    monkeypatch.setattr(factorization.importlib.util, "find_spec", lambda name: object() if installed else None)
    monkeypatch.setattr(factorization.importlib.metadata, "version", lambda name: f"of {name}")
    monkeypatch.setattr(factorization, "_cholmod", factorization._superlu)
    found = doctor.check_eigenproblem()
    assert found.status == "ok"
    assert found.says.endswith(
        "factors by CHOLMOD (cholespy of cholespy)" if installed else "factors by SuperLU (SciPy of scipy)"
    )


def test_without_pyvista_the_extra_is_named_and_nothing_is_broken(monkeypatch):
    monkeypatch.setattr(doctor, "find_spec", {}.get)
    found = doctor.check_pictures()
    assert (found.status, found.remedy) == ("note", 'python -m pip install "spectral-notes[pictures]"')


@pytest.mark.parametrize(
    ("code", "out", "err", "says"),
    [
        (1, "", "Traceback\nRuntimeError: neither EGL nor OSMesa", "no picture: RuntimeError: neither EGL nor OSMesa"),
        (-11, "", "", "the renderer ended with code -11"),
        (0, '{"red": 0.0, "blue": 0.1, "white": 0.7}\n', "", "the picture is wrong"),
    ],
)
def test_pictures_that_fail_are_found_and_gl_is_named(monkeypatch, code, out, err, says):
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: SimpleNamespace(returncode=code, stdout=out, stderr=err))
    found = doctor.check_pictures()
    assert found.status == "broken"
    assert says in found.says
    assert "libegl1" in found.remedy


def test_a_backend_that_shows_no_figures_is_told(monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    finding = doctor.check_pictures()
    assert finding.status == "broken"
    assert "MPLBACKEND=Agg in the environment" in finding.says and "unset MPLBACKEND" in finding.remedy
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    monkeypatch.setattr(doctor.subprocess, "run", lambda *_, **__: subprocess.CompletedProcess([], 1, "", "no driver"))
    assert doctor.check_pictures().says == "no picture: no driver"


def test_a_renderer_that_hangs_is_found(monkeypatch):
    def hang(*_, **__):
        raise subprocess.TimeoutExpired("python", 300)

    monkeypatch.setattr(subprocess, "run", hang)
    assert doctor.check_pictures().says == "no picture after five minutes"


def test_the_scene_has_both_colours():
    scene = doctor.render_scene()
    assert 0.02 < scene["blue"] < 0.5
    assert 0.02 < scene["red"] < 0.5
    assert scene["white"] > 0.3
    assert scene["renderer"]


@pytest.mark.parametrize(
    ("n", "k", "status"), [(10_000, 50, "ok"), (1_000_000, 200, "note"), (1_000_000, 1000, "broken")]
)
def test_memory_is_weighed(monkeypatch, n, k, status):
    monkeypatch.setattr(doctor.psutil, "virtual_memory", lambda: SimpleNamespace(available=6e9))
    found = doctor.check_memory(n, k)
    assert found.status == status
    assert found.says.startswith(f"6.0 GB free; {k} modes of {n:,} vertices need")
    assert bool(found.remedy) == (status != "ok")


def test_the_largest_mesh_in_one_piece_agrees_with_the_solver(monkeypatch):
    monkeypatch.setattr(doctor.psutil, "virtual_memory", lambda: SimpleNamespace(available=6e9))
    says = doctor.check_memory(1000, 100).says
    most = int(says.split(" up to ")[1].split(" vertices")[0].replace(",", ""))
    assert np.isclose(doctor.memory_needed(most, 100), 3e9, rtol=1e-3)
    for bad in ({"n_vertices": 0}, {"k": 0}):
        with pytest.raises(ValueError, match="must be at least 1"):
            examine(**bad)
