"""Read a file by VTK in a process of its own and write its surface as arrays: `python vtk_child.py FILE ARRAYS.npz`."""

import sys

import numpy as np


def main(source: str, target: str) -> None:
    """Write the vertices, corners and sizes of the polygons of a file's surface."""
    import pyvista as pv

    data = pv.read(source)
    if not isinstance(data, pv.PolyData):
        data = pv.wrap(data.extract_geometry() if hasattr(data, "extract_geometry") else data.extract_surface())
    if data.n_strips:
        data = data.triangulate()
    if not data.n_points:
        raise SystemExit("it finds no point in it")
    packed, place, corners, sizes = np.asarray(data.faces), 0, [], []
    while place < len(packed):
        sizes.append(int(packed[place]))
        corners.append(packed[place + 1 : place + 1 + sizes[-1]])
        place += 1 + sizes[-1]
    joined = np.concatenate([np.zeros(0, np.int64), *corners])
    vertices = np.asarray(data.points, dtype=np.float64)
    np.savez(target, vertices=vertices, corners=joined.astype(np.int64), sizes=np.array(sizes, dtype=np.int64))


if __name__ == "__main__":
    main(*sys.argv[1:])
