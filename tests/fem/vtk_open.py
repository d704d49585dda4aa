"""Opens lines.vtu and lines.pvd of the folder given, as vtk_test.cpp wrote them, with meshio and with VTK's own reader."""
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

folder = Path(sys.argv[1])
index = np.arange(5)
points = np.column_stack([index / 3, 0.1 * index, -1e-9 * index])

mesh = meshio.read(folder / "lines.vtu")
assert np.array_equal(mesh.points, points)  # every digit
assert [block.data.tolist() for block in mesh.cells] == [[[0, 1], [1, 2], [2, 3], [3, 4]]]
assert np.array_equal(mesh.point_data["displacement"], 2 * points)
assert np.array_equal(np.ravel(mesh.point_data['speed <m/s> & "more"']), index)
assert np.ravel(mesh.cell_data["body"][0]).tolist() == [1, 1, 2, 2]

reader = vtk.vtkXMLUnstructuredGridReader()
reader.SetFileName(str(folder / "lines.vtu"))
reader.Update()
grid = reader.GetOutput()
assert reader.GetErrorCode() == 0
assert grid.GetNumberOfCells() == 4 and grid.GetCellType(0) == vtk.VTK_LINE
assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), points)
assert np.array_equal(vtk_to_numpy(grid.GetPointData().GetArray("displacement")), 2 * points)
assert vtk_to_numpy(grid.GetCellData().GetArray("body")).tolist() == [1, 1, 2, 2]

files = [(float(d.get("timestep")), d.get("file")) for d in ElementTree.parse(folder / "lines.pvd").iter("DataSet")]
assert files == [(0.0, "lines.vtu"), (0.1, "lines.vtu")]
