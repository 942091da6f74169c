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
    cells = data.GetPolys()
    corners, ends = (pv.convert_array(part) for part in (cells.GetConnectivityArray(), cells.GetOffsetsArray()))
    vertices = np.asarray(data.points, dtype=np.float64)
    np.savez(target, vertices=vertices, corners=corners.astype(np.int64), sizes=np.diff(ends).astype(np.int64))


if __name__ == "__main__":
    main(*sys.argv[1:])
