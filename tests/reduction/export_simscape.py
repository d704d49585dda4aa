"""Opens boom.mat of the folder given with scipy and compares it with expected.txt of export_simscape_test.cpp."""
import sys
from pathlib import Path

import numpy as np
import scipy.io
import scipy.linalg

folder = Path(sys.argv[1])
data = scipy.io.loadmat(folder / "boom.mat", chars_as_strings=True)
P, Q, K, M, C = (data[name] for name in "PQKMC")
n = len(K)
values = np.loadtxt(folder / "expected.txt")
m, mc0, J0, origins, Ke, Me, De = np.split(values, np.cumsum([1, 3, 9, 6, n * n, n * n]))

assert data["__version__"] == "1.0" and data["__header__"].startswith(b"MATLAB 5.0")
assert np.array_equal(P, origins.reshape(2, 3))
assert np.array_equal(Q, [[1, 0, 0, 0]] * 2)
for A, expected in ((K, Ke), (M, Me), (C, De)):  # every bit, symmetric
    assert A.dtype == np.float64 and np.array_equal(A, expected.reshape(n, n)) and np.array_equal(A, A.T)
assert [name.strip() for name in data["interfaces"]] == ["root", "tip"]
assert data["units"][0].startswith("SI")

# A free body: six frequencies are zero, and rigid motions of the interfaces carry its mass.
frequencies = scipy.linalg.eigh(K, M, eigvals_only=True)
assert np.max(np.abs(frequencies[:6])) < 1e-5 * frequencies[6] and np.all(frequencies[6:] > 0)
R = np.zeros((n, 6))
for f, p in enumerate(P):
    R[6 * f:6 * f + 6] = np.eye(6)
    R[6 * f:6 * f + 3, 3:] = -np.cross(np.eye(3), p).T @ -np.eye(3)  # column j: e_j x p
rigid = R.T @ M @ R
assert np.allclose(rigid[:3, :3], m * np.eye(3), rtol=0, atol=1e-9 * m[0])
assert np.allclose(rigid[3:, 3:], J0.reshape(3, 3), rtol=0, atol=1e-9 * np.max(J0))
cx, cy, cz = mc0
assert np.allclose(rigid[:3, 3:], [[0, cz, -cy], [-cz, 0, cx], [cy, -cx, 0]], rtol=0, atol=1e-9 * np.max(np.abs(mc0)))
