"""Opens a body file with h5py: the arrays of full_body() in body_file_test.cpp, their attributes, both checksums."""
import hashlib
import sys
from pathlib import Path

import h5py
import numpy as np

SEAL = 512


def datasets(f):
    found = {}
    f.visititems(lambda name, item: found.update({name: item}) if isinstance(item, h5py.Dataset) else None)
    return found


def content_checksum(f):
    """As reduction/README.md says it is made."""
    kinds = {"<f8": "f64", "<i4": "i32", "|u1": "u8", "|O": "text"}
    digests = {}
    for name, d in datasets(f).items():
        kind = kinds[d.dtype.str]
        data = b"".join(t + b"\0" for t in np.ravel(d[()])) if kind == "text" else d[()].tobytes()
        shape = ",".join(map(str, d.shape))
        head = f"{kind}\n{shape}\n{d.attrs['units']}\n{d.attrs['description']}\n"
        digests[name] = hashlib.sha256(head.encode() + data).hexdigest()
    for name, value in f.attrs.items():
        if name != "checksum":
            digests["@" + name] = hashlib.sha256(str(value).encode()).hexdigest()
    lines = [f"{name} {digest}\n".encode() for name, digest in sorted(digests.items(), key=lambda p: p[0].encode())]
    return hashlib.sha256(b"".join(lines)).hexdigest()


def numbered(*shape):
    k, i, j = np.indices(shape if len(shape) == 3 else (1, *shape))
    return (100.0 * k + 10 * i + j).reshape(shape)


def texts(d):
    return d.asstr()[()].tolist()


def check(path):
    data = Path(path).read_bytes()
    version = int(data.split()[1])  # 2: with a body of more modes, the same one here
    head = f"flexboom-body {version} sha256 {hashlib.sha256(data[SEAL:]).hexdigest()}\n".encode()
    assert data[:SEAL] == head.ljust(SEAL, b"\0")

    f = h5py.File(path)
    n, points = 4, 5
    assert f.userblock_size == SEAL
    assert f.attrs["checksum"] == content_checksum(f)
    attributes = {"format": "flexboom-body", "version": version, "name": 'Ausleger α "4"\n', "structure": "solid",
                  "frame": "free"}
    if version == 2:
        attributes |= {f"more_modes/{name}": attributes[name] for name in ("name", "structure", "frame")}
        attributes |= {"more_modes": 1, "finer_elements": 0}
        for name in datasets(f["more_modes"]):
            assert np.array_equal(f[name][()], f["more_modes"][name][()], equal_nan=f[name].dtype.kind == "f"), name
    assert f.attrs.keys() == attributes.keys() | {"checksum"}
    for name, value in attributes.items():
        assert f.attrs[name] == value, name

    shapes = {"m": (), "mc0": (3,), "J0": (3, 3), "Ct": (3, n), "Cr0": (3, n), "Cr1": (n, 3, n), "Me": (n, n),
              "J1": (n, 3, 3), "J2": (n, n, 3, 3), "Ke": (n, n), "De": (n, n), "gram": (4 + 3 * n, 4 + 3 * n)}
    for name, shape in shapes.items():
        assert f[name].shape == shape and f[name].dtype == "<f8", name
    for name, d in datasets(f).items():
        units, description = d.attrs["units"], d.attrs["description"]
        assert isinstance(units, str) and description and "\n" not in description, name
        assert h5py.h5g.get_objinfo(f.id, name.encode()).mtime == 0, name  # equal bodies make equal files
        assert d.dtype.kind != "O" or h5py.check_string_dtype(d.dtype) == ("utf-8", None), name

    # The line mass of eq. 14, L = 1.2 m, 0.3 kg/m: shapes along y first, so rho tilde(u0) S is along z.
    L, rhoA = 1.2, 0.3
    assert np.isclose(f["m"][()], rhoA * L, rtol=1e-15)
    assert np.allclose(f["mc0"][()], [rhoA * L**2 / 2, 0, 0], rtol=1e-15)
    assert f["Ct"][1, 0] > 0 and f["Ct"][2, 2] > 0 and f["Ct"][1, 2] == 0
    assert f["Cr0"][2, 0] > 0 and f["Cr0"][1, 2] < 0
    Me, J2, Cr1 = f["Me"][()], f["J2"][()], f["Cr1"][()]
    assert np.allclose(np.trace(J2, axis1=2, axis2=3), 2 * Me, atol=1e-14)
    assert Cr1[0, 0, 2] > 0 and np.allclose(Cr1, -Cr1.transpose(2, 1, 0), atol=1e-15)  # y x z = x
    De = numbered(n, n)
    De[0, 1:4] = -0.0, 5e-324, np.finfo(float).max
    assert f["De"][()].tobytes() == De.tobytes()

    stacks = {"Kg/spin": 6, "Kg/acceleration": 3, "Kg/angular_acceleration": 3, "Kg/markers/0/force": 3,
              "Kg/markers/0/torque": 3, "Kg/markers/1/force": 3}
    for name, count in stacks.items():
        assert np.array_equal(f[name], numbered(count, n, n)), name
    assert f["Kg/markers/1/torque"].shape == (0, n, n)
    assert texts(f["Kg/markers/name"]) == ["tip", "root"]
    z = numbered(4 + 3 * n, 4 + 3 * n)
    assert np.array_equal(f["gram"], z + z.T)

    assert texts(f["coordinates/kind"]) == ["interface", "interface", "bending_y", "attachment"]
    assert f["coordinates/frequency_hz"][()].tolist() == [0, 0, 1 / 3, 7]
    assert texts(f["coordinates/interface"]) == ["root", "root", "", "tip"]
    assert texts(f["coordinates/direction"]) == ["ux", "rz", "", "Fx"]
    assert texts(f["interfaces/name"]) == ["root", "tip"]
    assert f["interfaces/components"][()].tolist() == [[1, 0, 0, 0, 0, 1], [0] * 6]
    assert f["interfaces/first_coordinate"][()].tolist() == [0, -1]
    assert texts(f["markers/name"]) == ["tip", "root"]
    assert f["markers/position"][()].tolist() == [[1, 2, 3], [4, 5, 6]]
    assert np.array_equal(f["markers/S"], numbered(4, 3, n)[[0, 2]])
    assert np.array_equal(f["markers/S_theta"], numbered(4, 3, n)[[1, 3]])

    assert np.array_equal(f["display/points"], numbered(3, points))
    assert np.array_equal(f["display/S"], numbered(points, 3, n))
    assert np.array_equal(f["display/S_theta"], numbered(points, 3, n))
    lines = np.split(f["display/line_points"][()], f["display/line_starts"][1:])
    assert [line.tolist() for line in lines] == [[0, 1, 2], [], [4, 3]]
    assert f["display/triangles"][()].tolist() == [[0, 1, 2], [2, 1, 4]]

    provenance = {"program": "flexboom 0.1.0", "libraries": "HDF5 1.10", "source": "boom.msh", "mesh_hash": "f00d",
                  "options": "modes = 4"}
    for name, value in provenance.items():
        assert f["provenance/" + name].asstr()[()] == value, name
    assert texts(f["certificate/name"]) == ["m = t^T M t", ""]
    assert f["certificate/value"][()].tolist() == [1, np.inf]
    assert f["certificate/reference"][()].tolist() == [2, -np.inf]
    assert f["certificate/relative_error"][0] == 0.5 and np.isnan(f["certificate/relative_error"][1])
    assert f["certificate/passed"][()].tolist() == [0, 1]
    assert f["full_freedoms"][()] == 2_000_000_000


if __name__ == "__main__":
    check(sys.argv[1])
