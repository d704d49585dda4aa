"""Opens boom.hdf5 of the folder given by the rules of EXUDYN's loader (LoadDictFromHDF5, SetWithDictionary: every entry
has a type it knows) and rebuilds the equations of ObjectFFRFreducedOrder (A. Zwoelfer, J. Gerstmayr, "The nodal-based
floating frame of reference formulation with modal reduction", Acta Mechanica 232, 2021) with Euler parameters at the
states of states.txt; compares them with the sums over mass points there (export_exudyn_test.cpp)."""
import sys
from pathlib import Path

import h5py
import numpy as np

folder = Path(sys.argv[1])
CASTS = {"int": int, "float": float, "float64": float, "ndarray": np.array}


def load(group):
    result = {}
    for name, item in group.items():
        kind = item.attrs["datatype"]
        assert isinstance(kind, str), (name, type(kind))
        if isinstance(item, h5py.Group):
            assert kind in ("dict", "list"), (name, kind)
            inner = load(item)
            result[name] = inner if kind == "dict" else [inner[f"item_{i}"] for i in range(len(inner))]
        else:
            result[name] = item[()].decode("utf-8") if kind == "str" else CASTS[kind](item[()])
    return result


def tilde(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


with h5py.File(folder / "boom.hdf5", "r") as file:
    data = load(file)

assert data["fileVersion"] == 1 and isinstance(data["fileVersion"], int)
assert data["type"] == "ObjectFFRFreducedOrderInterface"
assert data["rigidBodyNodeType"] == "NodeType.RotationEulerParameters"
assert data["postProcessingModes"] == {}
assert isinstance(data["totalMass"], float)
n, nodes, dimension, parameters, rigid, coordinates = data["infoList"]
assert data["infoList"].dtype == np.int64 and data["trigList"].dtype == np.int64
assert (dimension, parameters, rigid, coordinates) == (3, 4, 7, 7 + n)
assert data["modeBasis"].shape == (3 * nodes, n) and data["xRef"].shape == (3 * nodes,)
assert data["trigList"].ndim == 2 and data["trigList"].shape[1] == 3 and np.all(data["trigList"] < nodes)
assert isinstance(data["trigList"].tolist(), list)
assert np.array_equal(data["Mtt"], data["totalMass"] * np.eye(3))
assert np.array_equal(data["chiUtilde"], tilde(data["chiU"]))
for name, shape in {"massMatrixReduced": (n, n), "stiffnessMatrixReduced": (n, n), "inertiaLocal": (3, 3),
                    "mPsiTildePsi": (3 * n, n), "mPsiTildePsiTilde": (3 * n, 3 * n), "mPhitTPsi": (3, n),
                    "mPhitTPsiTilde": (3, 3 * n), "mXRefTildePsi": (3, n), "mXRefTildePsiTilde": (3, 3 * n)}.items():
    assert data[name].shape == shape and data[name].dtype == np.float64, name


def equations(p, omega, q, q_dot):
    """Mass matrix over (position, Euler parameters, q) and the forces that do not depend on accelerations."""
    p0, p1, p2, p3 = p
    G = 2 * np.array([[-p1, p0, p3, -p2], [-p2, -p3, p0, p1], [-p3, p2, -p1, p0]])  # local: omega = G p_dot
    E = np.array([[-p1, p0, -p3, p2], [-p2, p3, p0, -p1], [-p3, -p2, p1, p0]])
    A = E @ G.T / 2
    zeta, zeta_dot = (np.kron(x, np.eye(3)).T for x in (q, q_dot))  # 3n x 3
    first = data["totalMass"] * data["chiUtilde"] + data["mPhitTPsiTilde"] @ zeta
    coupling = data["mXRefTildePsi"] + zeta.T @ data["mPsiTildePsi"]
    X = data["mXRefTildePsiTilde"]
    J = data["inertiaLocal"] + X @ zeta + zeta.T @ X.T + zeta.T @ data["mPsiTildePsiTilde"] @ zeta
    J_dot_part = X @ zeta_dot + zeta.T @ data["mPsiTildePsiTilde"] @ zeta_dot
    M = np.block([[data["Mtt"], -A @ first @ G, A @ data["mPhitTPsi"]],
                  [(-A @ first @ G).T, G.T @ J @ G, -G.T @ coupling],
                  [(A @ data["mPhitTPsi"]).T, (-G.T @ coupling).T, data["massMatrixReduced"]]])
    elastic = np.kron(np.eye(n), omega) @ (X.T + data["mPsiTildePsiTilde"] @ zeta) @ omega
    force = np.concatenate([
        A @ (tilde(omega) @ first + 2 * data["mPhitTPsiTilde"] @ zeta_dot) @ omega,
        -G.T @ (tilde(omega) @ J + 2 * J_dot_part) @ omega,
        elastic + 2 * data["mPsiTildePsi"].T @ zeta_dot @ omega
        - data["stiffnessMatrixReduced"] @ q - data["dampingMatrixReduced"] @ q_dot])
    return M, force, G


states = np.loadtxt(folder / "states.txt", ndmin=2)
worst = 0
for row in states:
    p, omega, q, q_dot, M, Q = np.split(row, np.cumsum([4, 3, n, n, (6 + n) ** 2]))
    M = M.reshape(6 + n, 6 + n)
    mass, force, G = equations(p, omega, q, q_dot)
    T = np.zeros((6 + n, 7 + n))  # (v, omega, q_dot) from (v, p_dot, q_dot)
    T[:3, :3], T[3:6, 3:7], T[6:, 7:] = np.eye(3), G, np.eye(n)
    expected = T.T @ M @ T
    scale = np.sqrt(np.diag(expected))
    error = np.max(np.abs(mass - expected) / np.outer(scale, scale))
    forces = T.T @ Q
    blocks = (slice(0, 3), slice(3, 7), slice(7, None))
    errors = [np.max(np.abs(force[b] - forces[b])) / np.max(np.abs(forces[b])) for b in blocks]
    worst = max(worst, error, *errors)
assert worst < 1e-12, worst  # sums of a few thousand products; reached: a few 1e-15

if "markerNames" in data:
    # MarkerSuperElementRigid with equal weights: a rotation of the body about any axis turns the six nodes alike.
    x = data["xRef"].reshape(-1, 3)
    for name, members in zip(data["markerNames"], data["markerNodes"]):
        arms = x[members] - x[members].mean(axis=0)
        assert np.allclose(arms.T @ arms, np.trace(arms.T @ arms) / 3 * np.eye(3), rtol=0, atol=1e-12), name
