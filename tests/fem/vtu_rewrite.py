"""Writes the first .vtu given again as out_*.vtu into the folder given, in every way that VTK and meshio can."""
import sys
import warnings
from pathlib import Path

import meshio
import vtk

warnings.simplefilter("ignore")
source, folder = sys.argv[1], Path(sys.argv[2])
reader = vtk.vtkXMLUnstructuredGridReader()
reader.SetFileName(source)
reader.Update()

for mode in ("Ascii", "Binary", "Appended"):
    for compressor in ("None", "ZLib"):
        for header in ("32", "64"):
            writer = vtk.vtkXMLUnstructuredGridWriter()
            writer.SetInputData(reader.GetOutput())
            writer.SetFileName(str(folder / f"out_vtk_{mode}_{compressor}_{header}.vtu"))
            getattr(writer, f"SetDataModeTo{mode}")()
            getattr(writer, f"SetCompressorTypeTo{compressor}")()
            getattr(writer, f"SetHeaderTypeToUInt{header}")()
            writer.SetBlockSize(1024)  # several blocks even here
            assert writer.Write() == 1
writer.SetDataModeToAppended()
writer.SetFileName(str(folder / "out_vtk_base64.vtu"))
writer.EncodeAppendedDataOn()
assert writer.Write() == 1
writer.SetFileName(str(folder / "out_vtk_big_endian.vtu"))
writer.SetByteOrderToBigEndian()
assert writer.Write() == 1

mesh = meshio.read(source)
for binary, compression in ((False, None), (True, None), (True, "zlib")):
    mesh.write(folder / f"out_meshio_{binary}_{compression}.vtu", binary=binary, compression=compression)
