"""Opens every .vtu of the folder given with VTK and meshio; NAME.txt beside it says how many points and what volume."""
import sys
import warnings
from pathlib import Path

import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

warnings.simplefilter("ignore")
def grid_of(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetErrorCode() == 0
    return reader.GetOutput()


def position(cell, r):
    x, sub, w = [0.0] * 3, vtk.mutable(0), [0.0] * cell.GetNumberOfPoints()
    cell.EvaluateLocation(sub, list(r), x, w)
    return np.array(x)


def jacobian(cell, r):
    """By central differences, exact for quadratic shapes but for round-off."""
    h = 1e-3
    return np.linalg.det([(position(cell, r + h * e) - position(cell, r - h * e)) / (2 * h) for e in np.eye(3)])


def volume(cell):
    name = cell.GetClassName()
    total = 0
    n = 3  # exact: the shapes are quadratic, so the Jacobian has degree 3, and 5 with the factors of the collapse
    a, w = np.polynomial.legendre.leggauss(n)
    a, w = (a + 1) / 2, w / 2
    for i in range(n):
        for j in range(n):
            for k in range(n):
                r, factor = np.array([a[i], a[j], a[k]]), w[i] * w[j] * w[k]
                if "Wedge" in name or "Tet" in name:  # the cube collapsed
                    r[1] *= 1 - r[0]
                    factor *= 1 - r[0] if "Wedge" in name else (1 - r[0]) * (1 - r[0] - r[1])
                if "Tet" in name:
                    r[2] *= 1 - r[0] - r[1]
                det = jacobian(cell, r)
                # vtkWedge documents its first triangle with the normal outwards and interpolates it inwards.
                det = -det if cell.GetCellType() == 13 else det
                assert det > 0, (name, r, det)
                total += det * factor
    return total


count = 0
for path in sorted(Path(sys.argv[1]).glob("*.vtu")):
    if path.name == "large.vtu":
        continue
    number, size = path.with_suffix(".txt").read_text().split()
    grid = grid_of(path)
    assert grid.GetNumberOfPoints() == int(number) and grid.GetNumberOfCells() == 2, path
    cells = [grid.GetCell(i) for i in range(2)]
    if cells[0].GetCellType() == 3:
        measured = sum(np.sqrt(c.GetLength2()) for c in cells)
    else:
        measured = 2 * volume(cells[0])
    assert abs(measured / float(size) - 1) < 1e-10, (path, measured, size)  # round-off of the differences
    assert vtk_to_numpy(grid.GetCellData().GetArray("set:first")).tolist() == [1, 0]
    assert vtk_to_numpy(grid.GetPointData().GetArray("set:root")).tolist()[:3].count(1) == 2
    if cells[0].GetCellType() != 26:  # meshio 7.0.0 opens no wedge15 (KeyError in its table of dimensions)
        mesh = meshio.read(path)
        assert len(mesh.points) == int(number) and sum(len(b.data) for b in mesh.cells) == 2, path
        assert np.ravel(np.concatenate(mesh.cell_data["set:both"])).tolist() == [1, 1]
    count += 1
assert count == 19, count

path = Path(sys.argv[1]) / "large.vtu"
mesh, grid = meshio.read(path), grid_of(path)
for points, third, last in (
    (mesh.points, mesh.point_data["third"], mesh.point_data["set:last"]),
    (
        vtk_to_numpy(grid.GetPoints().GetData()),
        vtk_to_numpy(grid.GetPointData().GetArray("third")),
        vtk_to_numpy(grid.GetPointData().GetArray("set:last")),
    ),
):
    assert points.shape == (10001, 3) and points[5000, 1] == 5000 / 3
    assert np.array_equal(third, points[:, :2])
    assert np.flatnonzero(np.ravel(last)).tolist() == [10000]
assert [b.type for b in mesh.cells] == ["hexahedron20", "tetra"] and grid.GetNumberOfCells() == 3
