"""Opens the Matrix Market files of the folder given with scipy: a free model, as matrix_market_test.cpp wrote it."""
import sys
from pathlib import Path

import numpy as np
import scipy.io

folder = Path(sys.argv[1])
K, M = (scipy.io.mmread(folder / name).tocsr() for name in ("K.mtx", "M.mtx"))
T = scipy.io.mmread(folder / "T.mtx")
freedoms = np.genfromtxt(folder / "freedoms.csv", delimiter=",", names=True, dtype=int)

assert scipy.io.mminfo(folder / "K.mtx")[3:] == ("coordinate", "real", "symmetric")
assert freedoms.dtype.names == ("row", "node", "element", "component", "label")
assert np.array_equal(freedoms["row"], np.arange(K.shape[0]))
assert K.shape == M.shape == (len(T), len(T)) and T.shape[1] == 6
assert abs(K - K.T).max() == 0 and abs(M - M.T).max() == 0  # both triangles from one
assert np.all((freedoms["node"] >= 0) != (freedoms["element"] >= 0))
translations = T[freedoms["node"] >= 0, :3]
assert np.array_equal(translations, np.eye(6)[freedoms["component"][freedoms["node"] >= 0], :3])
assert abs(K @ T).max() < 1e-12 * abs(K).max()
rigid = T.T @ (M @ T)
assert np.allclose(rigid[:3, :3], rigid[0, 0] * np.eye(3), rtol=0, atol=1e-14 * rigid[0, 0])
