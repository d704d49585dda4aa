"""Changes copies of a body file; NAME.txt beside NAME.h5 holds what the reader must say of it."""
import hashlib
import shutil
import sys
from pathlib import Path

import h5py
import numpy as np
from body_file_open import SEAL, content_checksum

SOURCE = Path(sys.argv[1])


def seal(path):
    data = path.read_bytes()[SEAL:]
    path.write_bytes(f"flexboom-body 1 sha256 {hashlib.sha256(data).hexdigest()}\n".encode().ljust(SEAL, b"\0") + data)


def damage(name, text, change, content=False, sealed=True):
    """`change(f)`; then the checksum of the content and the seal are made again, or not."""
    path = SOURCE.with_name(name + ".h5")
    shutil.copy(SOURCE, path)
    with h5py.File(path, "r+") as f:
        change(f)
        if content:
            f.attrs["checksum"] = content_checksum(f)
    if sealed:
        seal(path)
    path.with_suffix(".txt").write_text(text)


def replace(name, data, **options):
    def change(f):
        attributes = dict(f[name].attrs)
        del f[name]
        d = f.create_dataset(name, data=data, **options)
        d.attrs.update(attributes)
    return change


def put(name, index, value):
    def change(f):
        f[name][index] = value
    return change


def attribute(name, value, dataset="/"):
    def change(f):
        f[dataset].attrs[name] = value
    return change


def remove(name):
    def change(f):
        del f[name]
    return change


def group_instead(f):
    del f["Ke"]
    f.create_group("Ke")


def sparse(f):
    del f["Me"]
    f.create_dataset("Me", shape=(10**6, 10**6), dtype="<f8", chunks=(100, 100))


changed = "checksum does not match: the file was changed after it was written"
content_changed = "checksum of the content does not match: the file was changed after it was written"

damage("unsealed", changed, put("m", (), 2.0), sealed=False)
damage("value", content_changed, put("J1", (0, 0, 0), 2.0))
damage("last_bit", content_changed, lambda f: f["m"].__setitem__((), np.nextafter(f["m"][()], 1)))
damage("text", content_changed, put("provenance/source", (), "other.msh"))
damage("title", content_changed, attribute("name", "another"))
damage("description", content_changed, attribute("description", "damping", "De"))
damage("units", 'dataset "mc0" has units "lb in", must have "kg m"', attribute("units", "lb in", "mc0"))
damage("format", 'the attribute "format" must be "flexboom-body"', attribute("format", "other"), content=True)
damage("version", 'the attribute "version" must be 1', attribute("version", np.int32(2)), content=True)
damage("version_type", 'attribute "version" has another type', attribute("version", "1"), content=True)
damage("no_frame", 'the file has no attribute "frame"', lambda f: f.attrs.__delitem__("frame"))
damage("no_checksum", 'the file has no attribute "checksum"', lambda f: f.attrs.__delitem__("checksum"))
damage("missing", 'dataset "Kg/spin" is missing', remove("Kg/spin"))
damage("missing_group", 'dataset "Kg/spin" is missing', remove("Kg"))
damage("group", '"Ke" is not a dataset', group_instead)
damage("shape", 'dataset "Ct" is 3 x 5, must be 3 x 4', replace("Ct", np.zeros((3, 5))))
damage("rank", 'dataset "J2" is 16 x 9, must be 4 x 4 x 3 x 3', replace("J2", np.zeros((16, 9))))
damage("scalar", 'dataset "Me" is a single value, must be a list', replace("Me", 1.0))
damage("null", 'dataset "m" has no shape', replace("m", h5py.Empty("<f8")))
damage("single", 'dataset "J0" has another type, must be f64', replace("J0", np.eye(3, dtype="<f4")))
damage("big_endian", 'dataset "J0" has another type, must be f64', replace("J0", np.eye(3, dtype=">f8")))
damage("fixed_text", 'dataset "markers/name" has another type, must be text',
       replace("markers/name", np.array([b"tip", b"root"])))
damage("absurd", 'dataset "Me" is 1000000 x 1000000: more than the file can hold', sparse)
damage("five_spins", 'dataset "Kg/spin" has 5 entries, must have 0 or 6', replace("Kg/spin", np.zeros((5, 4, 4))))
damage("gram", 'dataset "gram" has 4 entries, must have 0 or 16', replace("gram", np.zeros((4, 4))))
damage("nan", "Ke has entries that are not finite", put("Ke", (1, 1), np.nan))
damage("bool", "interfaces/components must be 0 or 1, is 2", put("interfaces/components", (0, 0), 2))
damage("starts", 'dataset "display/line_starts" must begin with 0', put("display/line_starts", 1, 9))
damage("starts_negative", 'dataset "display/line_starts" must begin with 0', put("display/line_starts", 0, -1))
damage("line", "display/lines has point 5 of 5", put("display/line_points", 1, 5), content=True)
damage("triangle", "display/triangles has point -1 of 5", put("display/triangles", (1, 2), -1), content=True)
damage("mass", "m must be positive", put("m", (), -1.0), content=True)
damage("indefinite", "Me must be positive definite", put("Me", (0, 0), -1.0), content=True)

with h5py.File(SOURCE.with_name("foreign.h5"), "w") as f:
    f["a"] = 1
SOURCE.with_name("foreign.txt").write_text("an HDF5 file, but not a reduced body of flexboom")
stripped = SOURCE.with_name("stripped.h5")
stripped.write_bytes(SOURCE.read_bytes()[SEAL:])
stripped.with_suffix(".txt").write_text("an HDF5 file, but not a reduced body of flexboom")
