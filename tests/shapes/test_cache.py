"""The cache: what is kept, what is built again, and what never fails."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import platformdirs
import pytest

from spectral_notes import shapes
from spectral_notes.shapes import cache
from spectral_notes.shapes.cache import cache_directory, cache_key, cached_arrays


class Recipe:
    """Builds two arrays and counts how often."""

    def __init__(self) -> None:
        self.built = 0

    def __call__(self) -> cache.Arrays:
        self.built += 1
        return {"vertices": np.linspace(0.0, 1.0, 300).reshape(-1, 3), "faces": np.arange(30).reshape(-1, 3)}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache of its own."""
    monkeypatch.setenv("SPECTRAL_NOTES_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def module(tmp_path: Path) -> ModuleType:
    """A module with a text that can be changed."""
    module = ModuleType("recipe")
    module.__file__ = str(tmp_path / "recipe.py")
    Path(module.__file__).write_text("radius = 1\n")
    return module


def test_second_call_reads_what_the_first_one_built(place: Path) -> None:
    build = Recipe()
    first, second = (cached_arrays("ball", {"step": 0.1}, [shapes], build) for _ in range(2))
    assert build.built == 1
    assert sorted(second) == ["faces", "vertices"]
    for name, array in first.items():
        assert array.dtype == second[name].dtype
        np.testing.assert_array_equal(array, second[name])
    (entry,) = place.iterdir()
    assert entry.name.startswith("ball-")
    assert entry.suffix == ".npz"


def test_key_changes_with_name_parameters_source_and_versions(
    module: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    key = cache_key("ball", {"step": 0.1}, [module])
    assert key == cache_key("ball", {"step": 0.1}, [module])
    others = [cache_key("egg", {"step": 0.1}, [module]), cache_key("ball", {"step": 0.2}, [module])]
    Path(str(module.__file__)).write_text("radius = 2\n")
    others.append(cache_key("ball", {"step": 0.1}, [module]))
    Path(str(module.__file__)).write_text("radius = 1\n")
    monkeypatch.setattr(cache, "version", lambda library: "0.0" if library == "libigl" else "1.0")
    others.append(cache_key("ball", {"step": 0.1}, [module]))
    assert len({key, *others}) == 5


def test_changed_source_is_built_again(place: Path, module: ModuleType) -> None:
    build = Recipe()
    cached_arrays("ball", {}, [module], build)
    Path(str(module.__file__)).write_text("radius = 3\n")
    cached_arrays("ball", {}, [module], build)
    assert build.built == 2


@pytest.mark.parametrize("damage", ["flipped", "truncated", "empty", "garbage", "directory"])
def test_damaged_entry_is_built_again_and_replaced(place: Path, damage: str) -> None:
    build = Recipe()
    intact = cached_arrays("ball", {}, [shapes], build)
    (entry,) = place.iterdir()
    content = bytearray(entry.read_bytes())
    if damage == "flipped":
        content[len(content) // 2] ^= 1
    elif damage == "truncated":
        del content[len(content) // 2 :]
    elif damage == "empty":
        content.clear()
    else:
        content[:] = b"not an archive"
    entry.write_bytes(content)
    if damage == "directory":
        entry.unlink()
        entry.mkdir()
    again = cached_arrays("ball", {}, [shapes], build)
    assert build.built == 2
    np.testing.assert_array_equal(again["vertices"], intact["vertices"])
    cached_arrays("ball", {}, [shapes], build)
    assert build.built == (3 if damage == "directory" else 2)  # a directory in its place cannot be replaced
    assert [file.name for file in place.iterdir()] == [entry.name]


def test_place_that_cannot_be_written_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("SPECTRAL_NOTES_CACHE", str(tmp_path / "file" / "cache"))
    build = Recipe()
    for _ in range(2):
        assert len(cached_arrays("ball", {}, [shapes], build)["vertices"]) == 100
    assert build.built == 2


@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_failed_write_leaves_nothing_behind(
    place: Path, monkeypatch: pytest.MonkeyPatch, error: type[BaseException]
) -> None:
    def fail(file: object, **arrays: object) -> None:
        file.write(b"half")  # type: ignore[attr-defined]
        raise error

    monkeypatch.setattr(cache.np, "savez", fail)
    if error is OSError:
        assert "faces" in cached_arrays("ball", {}, [shapes], Recipe())
    else:
        with pytest.raises(KeyboardInterrupt):
            cached_arrays("ball", {}, [shapes], Recipe())
    assert list(place.iterdir()) == []


def test_directory_is_the_users_unless_the_variable_says_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SPECTRAL_NOTES_CACHE", raising=False)
    assert cache_directory() == Path(platformdirs.user_cache_dir("spectral_notes", appauthor=False))
    monkeypatch.setenv("SPECTRAL_NOTES_CACHE", "~/elsewhere")
    assert cache_directory() == Path.home() / "elsewhere"
