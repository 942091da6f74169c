"""Classic meshes, downloaded on request only: pinned addresses, checked by SHA-256, licence and credit shown.

Nothing is fetched on import, nor by any notebook or test. A file is stored in the user's cache once it has arrived
whole and its hash is right; whatever goes wrong on the way leaves nothing behind.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

import numpy as np

from spectral_notes._checks import as_choice, as_number
from spectral_notes.files.mesh_files import read_mesh
from spectral_notes.meshes import TriangleMesh, clean_mesh
from spectral_notes.shapes.cache import cache_directory

_RAW = "https://raw.githubusercontent.com/"
_ODEDSTEIN = _RAW + "odedstein/meshes/835213277571d625722d25880c9c3010c6f45a5a/objects/"
_JACOBSON = _RAW + "alecjacobson/common-3d-test-models/8a4f8642acaf43f9cd7b67858a1502e1055ef202/data/"
_SIMJEB = _RAW + "simjeb/simjeb.github.io/56793e6f464e8aba27c21d5aee215be77d506733/data/meshes/"
_MAKEHUMAN = _RAW + "makehumancommunity/mpfb2/80919fa4682335c41847f761a4d79dcad4124732/src/mpfb/data/3dobjs/"


@dataclass(frozen=True)
class Dataset:
    """Hold where a classic mesh comes from, what its file must be, and on what terms it may be used.

    Parameters
    ----------
    url : str
        Address of the file at a fixed commit.
    size : int
        Bytes of the file.
    sha256 : str
        Hash of the file.
    licence : str
        Terms of use, in short.
    credit : str
        Whom to name.
    group : str
        Group of faces to keep, for files that hold more than one shape; all of them where empty.
    """

    url: str
    size: int
    sha256: str
    licence: str
    credit: str
    group: str = ""


_STANFORD = "research use; redistribution with credit; no commercial use"

DATASETS: Mapping[str, Dataset] = MappingProxyType(
    {
        "spot": Dataset(
            _JACOBSON + "spot.obj",
            330624,
            "0738b5e8608fed74e5e8c7aa8dd0af97b4b74f9f6cbf7aac84cd7e40b2e44a75",
            "public domain",
            "Keenan Crane",
        ),
        "bunny": Dataset(
            _ODEDSTEIN + "bunny/bunny.obj",
            538223,
            "d97f4aa37c2f3bfb14eceb3d06ac1f466062dc45f08e019bfbae9704c28654b6",
            _STANFORD,
            "Stanford Computer Graphics Laboratory",
        ),
        "armadillo": Dataset(
            _ODEDSTEIN + "armadillo/armadillo.obj",
            961652,
            "17200138dad1ad0f86ef9a98dd38f9932098b2c9e94d8694bd3f6143601e8c54",
            _STANFORD,
            "Stanford Computer Graphics Laboratory",
        ),
        "penguin": Dataset(
            _ODEDSTEIN + "penguin/penguin.obj",
            210024,
            "ff6c992f97ea34c1a1f6a9477a2bcd68148a60fae68797d85765f7730d5ee9f2",
            "CC BY 4.0",
            "Oded Stein",
        ),
        "cat": Dataset(
            _ODEDSTEIN + "cat/cat-low-resolution.obj",
            501557,
            "543b94dfe485d6f0661111b9fc063d627b11d24898f07ff6fd91e25211bbbfc7",
            "CC BY 4.0",
            "the collection of Oded Stein",
        ),
        "nefertiti": Dataset(
            _ODEDSTEIN + "nefertiti/nefertiti-lowres.obj",
            2479453,
            "3ae65c1ec016d2903af36e2fff43c8dd7cd982cec45ce09fc57f18a5ee1c3ffb",
            "public domain, says the collection",
            "the collection of Oded Stein",
        ),
        "simjeb_bracket": Dataset(
            _SIMJEB + "631.obj",
            852953,
            "83dfa72b43065aa75865f79dc76364c78fc40af52fec3e3ce7f56e21cc088d17",
            "ODC-By 1.0, with reservations about the designs it was made from",
            "the SimJEB data set of jet engine brackets",
        ),
        "human": Dataset(
            _MAKEHUMAN + "base.obj",
            1749303,
            "8e761e6624b8f54536409135d1636da63b32486a90d4897f84e121d144f6fb4c",
            "CC0",
            "the MakeHuman community",
            group="body",
        ),
    }
)


def fetch_mesh(name: str, *, timeout: float = 30.0, datasets: Mapping[str, Dataset] = DATASETS) -> TriangleMesh:
    """Return a classic mesh, downloaded if it is not in the cache yet; prints its licence and credit.

    Parameters
    ----------
    name : str
        One of the names of `DATASETS`.
    timeout : float
        Seconds of silence after which a download is given up.
    datasets : mapping of str to Dataset
        Where to look the name up.

    Returns
    -------
    TriangleMesh
        The mesh, in the units of its file.

    Raises
    ------
    ValueError
        If there is no such data set, or the file that came has the wrong hash.
    ConnectionError
        If the file could not be downloaded.
    ModuleNotFoundError
        If pooch is not installed; it is part of ``pip install "spectral-notes[data]"``.

    Examples
    --------
    >>> sorted(DATASETS)
    ['armadillo', 'bunny', 'cat', 'human', 'nefertiti', 'penguin', 'simjeb_bracket', 'spot']
    """
    record = datasets[as_choice("name", name, tuple(datasets))]
    path = _download(name, record, as_number("timeout", timeout, above=0.0))
    print(f"{name}: {record.licence}; credit: {record.credit}. {record.url}")
    if record.group:
        return _read_group(path, record.group, name)
    mesh = read_mesh(path)
    return TriangleMesh(mesh.vertices, mesh.faces, name)


def _download(name: str, record: Dataset, timeout: float) -> Path:
    """Path of the file in the cache, fetched if need be."""
    try:
        import pooch
        import requests
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f'{error.name} is missing; pip install "spectral-notes[data]" brings it') from error
    pooch.get_logger().setLevel("WARNING")
    get = pooch.HTTPDownloader(timeout=timeout)
    folder = cache_directory() / "datasets"
    file_name = f"{name}-{record.sha256[:12]}{Path(record.url).suffix}"
    try:
        return Path(pooch.retrieve(record.url, f"sha256:{record.sha256}", file_name, folder, downloader=get))
    except requests.exceptions.RequestException as error:
        raise ConnectionError(f"name {name!r} could not be downloaded from {record.url}: {error}") from error
    except ValueError as error:
        raise ValueError(
            f"name {name!r} came with the wrong hash from {record.url}; nothing was kept. Try again later: {error}"
        ) from error


def _read_group(path: Path, group: str, name: str) -> TriangleMesh:
    """Read the faces of one group of an OBJ file; polygons become fans of triangles."""
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    inside = False
    for line in path.read_text().splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            vertices.append([float(x) for x in rest[:3]])
        elif word == "g":
            inside = rest == [group]
        elif word == "f" and inside:
            first, *others = (int(corner.split("/")[0]) - 1 for corner in rest)
            faces += [[first, a, b] for a, b in pairwise(others)]
    used, faces_in_used = np.unique(np.array(faces), return_inverse=True)
    return clean_mesh(np.array(vertices)[used], faces_in_used.reshape(-1, 3), name)
