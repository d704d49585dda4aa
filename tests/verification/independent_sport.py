#!/usr/bin/python3
"""Independent integration of the SPORT scene: no modal invariants, no code shared with flexboom.

Model. Each boom is a set of point masses dm at Gauss points x along its line. With Theta the hinge angle, the boom axis
a = cos(Theta) s + sin(Theta) n (s stowed direction, n outward normal) and b = da/dTheta, a point sits in hub axes at
    p = d + x a + w b,        w(x) = sum_k phi_k(x) q_k,     phi_k: clamped-free eq. 14 shapes with tip value +2.
Its acceleration in hub axes is linear in the accelerations u_dot = (A^T V_dot, omega_dot, Theta_ddot_i, q_ddot_ik):
    acc = J u_dot + g,   J = [1, -tilde(p), x b - w a, phi_k b],
    g = omega x (omega x p) + 2 omega x (Theta_dot (x b - w a) + w_dot b)
        - Theta_dot^2 (x a + w b) - 2 Theta_dot w_dot a.
Virtual power: (sum dm J^T J + hub) u_dot = generalised forces - sum dm J^T g - gyroscopic torque of the hub. The sums
are formed anew over the points at every evaluation. Forces: hinge torque
    tau = (P1 / Thr) (pi/2 - Theta) - P2 Theta_dot - [Theta > Thr] P3 (Theta - Thr),   Thr = pi/2,
and per mode -Ke q - 2 zeta omega Me q_dot, Ke = EI int phi''^2, Me = rho A int phi^2 by the same points. Hub: V and R
in inertial axes, unit quaternion, omega in hub axes. The state holds Delta = Theta - pi/2: no digits lost at the stop.

Time integration, two unrelated methods:
  radau   collocation at the s Radau points (order 2 s - 1, L-stable), Newton with complex-step Jacobian; the step is
          chosen so that the last Legendre coefficients of the collocation polynomial stay below rtol
          (Hairer & Wanner, Solving Ordinary Differential Equations II, IV.5 and IV.8)
  dop853  explicit Runge-Kutta of order 8 (scipy)
Every crossing of the stop ends a step: the step is repeated with a corrected length until Delta = 0 at its end.
Crossings slower than SETTLED rad/s are the last ones followed for their hinge.

Run with no arguments for the options.
"""
import argparse
import csv
import json
import pathlib
import sys

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq
from scipy.special import roots_jacobi

SCENE = json.loads("""
{
  "hub": {"mass": 8.5, "inertia": [[0.10477, 0.003148, 0.00098475], [0.003148, 0.05858, -0.001259],
                                   [0.00098475, -0.001259, 0.134942]]},
  "E": 67e9, "rho": 2840, "zeta": 0.05, "P2": 0.01, "P3": 10, "start_degrees": -3,
  "booms": [
    {"name": "efield_plus", "L": 0.295, "d": 0.005, "P1": 0.35,
     "point": [ 0.116, -0.151,  0.029], "stowed": [0, 1, 0], "normal": [ 1, 0,  0]},
    {"name": "efield_minus", "L": 0.295, "d": 0.005, "P1": 0.35,
     "point": [-0.111, -0.151,  0.029], "stowed": [0, 1, 0], "normal": [-1, 0,  0]},
    {"name": "sip", "L": 0.302, "d": 0.010, "P1": 0.25,
     "point": [ 0.091, -0.151, -0.053], "stowed": [0, 1, 0], "normal": [ 0, 0, -1]},
    {"name": "slp", "L": 0.146, "d": 0.005, "P1": 0.31,
     "point": [ 0.069, -0.151,  0.053], "stowed": [0, 1, 0], "normal": [ 0, 0,  1]}
  ]
}
""")
SETTLED = 1e-13  # rad/s: slower crossings move the stop torque by less than round-off of the motion


# ------------------------------------------------------------------------------------------------------------ model
def cantilever_root(k):
    """k-th root of cos(a) cosh(a) = -1."""
    guess = (k - 0.5) * np.pi
    return brentq(lambda a: np.cos(a) + 1 / np.cosh(a), guess - 0.4, guess + 0.4, xtol=1e-15, rtol=1e-15)


def clamped_shape(k, z):
    """phi_k and phi_k'' (per unit length squared) at z = x / L, tip value +2; the form free of cancellation."""
    a = cantilever_root(k)
    e = np.exp(-a)
    one_minus_sigma = e * (e + np.cos(a) + np.sin(a)) / (0.5 * (1 + e * e) + e * np.cos(a))
    x = a * z
    grow, decay, wave = one_minus_sigma * np.sinh(x), np.exp(-x), np.cos(x) - (1 - one_minus_sigma) * np.sin(x)
    sign = 1 if k % 2 else -1
    return sign * (decay + grow - wave), sign * a * a * (decay + grow + wave)


def tilde(a):
    """Cross-product matrix of the last axis."""
    z = np.zeros_like(a[..., 0])
    rows = [[z, -a[..., 2], a[..., 1]], [a[..., 2], z, -a[..., 0]], [-a[..., 1], a[..., 0], z]]
    return np.stack([np.stack(r, -1) for r in rows], -2)


class Model:
    """The scene as arrays; `rate` is the right-hand side, for any leading batch shape, real or complex."""

    def __init__(self, scene, modes, points, fixed_hub):
        booms, hub = scene["booms"], scene["hub"]
        self.names = [b["name"] for b in booms]
        self.B, self.n, self.fixed_hub, self.P2, self.P3 = len(booms), modes, fixed_hub, scene["P2"], scene["P3"]
        self.k_hinge = np.array([b["P1"] / (np.pi / 2) for b in booms])
        self.hub_mass = hub["mass"]
        self.hub_J = np.array(hub["inertia"])
        vectors = (np.array([b[key] for b in booms], float) for key in ("point", "stowed", "normal"))
        self.d, self.s, self.n_out = vectors
        L, dia = np.array([b["L"] for b in booms]), np.array([b["d"] for b in booms])
        rhoA, EI = scene["rho"] * np.pi * dia**2 / 4, scene["E"] * np.pi * dia**4 / 64
        z, weight = np.polynomial.legendre.leggauss(points)
        z, weight = (z + 1) / 2, weight / 2
        self.x = L[:, None] * z                                   # boom, point
        self.dm = (rhoA * L)[:, None] * weight
        phi, phi2 = (np.array(v) for v in zip(*(clamped_shape(k + 1, z) for k in range(modes))))
        self.phi = phi                                            # mode, point; the same for all booms
        Me = (rhoA * L)[:, None] * (phi**2 @ weight)
        self.Ke = (EI / L**3)[:, None] * (phi2**2 @ weight)
        self.De = 2 * scene["zeta"] * np.sqrt(self.Ke * Me)       # 2 zeta omega Me
        self._layout()

    def _layout(self):
        """Slices of the state and rows of each boom in u = (V, omega, Theta_dot, q_dot)."""
        B, n = self.B, self.n
        sizes = {"R": 3, "V": 3, "quat": 4, "omega": 3,
                 "Delta": B, "Delta_dot": B, "q": B * n, "q_dot": B * n, "lost": 1}
        ends = np.cumsum(list(sizes.values()))
        self.at = {key: slice(int(e) - size, int(e)) for (key, size), e in zip(sizes.items(), ends)}
        self.size = int(ends[-1])
        self.rows = [np.r_[0:6, 6 + i, 6 + B + n * i:6 + B + n * (i + 1)] for i in range(B)]
        self.group = np.arange(self.size)                         # components judged on one scale: the vectors
        for key in ("R", "V", "omega"):
            self.group[self.at[key]] = self.at[key].start

    def initial_state(self, degrees):
        y = np.zeros(self.size)
        y[self.at["quat"].start] = 1
        y[self.at["Delta"]] = np.radians(degrees)
        return y

    def points(self, y):
        """Positions p, J and velocity parts of the mass points, hub axes; shapes ..., boom, point, 3 (, coordinate)."""
        at, shape = self.at, y.shape[:-1]
        Delta, rate = y[..., at["Delta"]], y[..., at["Delta_dot"]]
        q, q_dot = (y[..., at[key]].reshape(shape + (self.B, self.n)) for key in ("q", "q_dot"))
        c, s = -np.sin(Delta)[..., None], np.cos(Delta)[..., None]             # of Theta = pi/2 + Delta
        a, b = (c * self.s + s * self.n_out)[..., None, :], (-s * self.s + c * self.n_out)[..., None, :]
        x, w, w_dot = self.x[..., None], (q @ self.phi)[..., None], (q_dot @ self.phi)[..., None]
        p, turn = self.d[:, None, :] + x * a + w * b, x * b - w * a            # turn = dp/dTheta
        rate = rate[..., None, None]
        relative = rate * turn + w_dot * b
        bending = -rate**2 * (x * a + w * b) - 2 * rate * w_dot * a
        J = np.empty(p.shape + (7 + self.n,), y.dtype)
        J[..., :3], J[..., 3:6], J[..., 6] = np.eye(3), -tilde(p), turn
        J[..., 7:] = b[..., None] * self.phi.T[:, None, :]
        return p, J, relative, bending

    def forces(self, y, contact):
        """Hinge torques and modal forces, and the power lost in dampers."""
        at = self.at
        rate, q_dot = y[..., at["Delta_dot"]], y[..., at["q_dot"]]
        tau = -(self.k_hinge + self.P3 * contact) * y[..., at["Delta"]] - self.P2 * rate
        modal = -self.Ke.ravel() * y[..., at["q"]] - self.De.ravel() * q_dot
        lost = self.P2 * (rate**2).sum(-1) + (self.De.ravel() * q_dot**2).sum(-1)
        return tau, modal, lost

    def mass_and_load(self, y, contact):
        """M (all rows) and the right-hand side of M u_dot = f, plus the power lost."""
        omega = y[..., self.at["omega"]]
        p, J, relative, bending = self.points(y)
        W = tilde(omega)[..., None, :, :]                                     # broadcast over booms
        WT = W.swapaxes(-1, -2)
        g = (p @ WT + 2 * relative) @ WT + bending
        root = np.sqrt(self.dm)[..., None]
        flat = (J * root[..., None]).reshape(J.shape[:-3] + (-1, J.shape[-1]))
        flat_T = flat.swapaxes(-1, -2)
        M_boom = flat_T @ flat
        f_boom = -(flat_T @ (g * root).reshape(g.shape[:-2] + (-1, 1)))[..., 0]
        tau, modal, lost = self.forces(y, contact)
        N = 6 + self.B * (1 + self.n)
        M, f = np.zeros(y.shape[:-1] + (N, N), y.dtype), np.zeros(y.shape[:-1] + (N,), y.dtype)
        M[..., :3, :3], M[..., 3:6, 3:6] = self.hub_mass * np.eye(3), self.hub_J
        f[..., 3:6] = -np.cross(omega, omega @ self.hub_J)
        f[..., 6:6 + self.B], f[..., 6 + self.B:] = tau, modal
        for i, rows in enumerate(self.rows):
            M[..., rows[:, None], rows] += M_boom[..., i, :, :]
            f[..., rows] += f_boom[..., i, :]
        return M, f, lost

    def rate(self, y, contact):
        """dy/dt."""
        at, M, f, lost = self.at, *self.mass_and_load(y, contact)
        acc = np.zeros_like(f)
        free = slice(6, None) if self.fixed_hub else slice(0, None)
        acc[..., free] = np.linalg.solve(M[..., free, free], f[..., free, None])[..., 0]
        quat, omega = y[..., at["quat"]], y[..., at["omega"]]
        w, v = quat[..., :1], quat[..., 1:]
        dy = np.empty_like(acc, shape=y.shape)
        dy[..., at["R"]] = y[..., at["V"]]
        dy[..., at["V"]] = rotate(quat, acc[..., :3])
        dy[..., at["quat"]] = 0.5 * np.concatenate(
            [-(v * omega).sum(-1, keepdims=True), w * omega + np.cross(v, omega)], -1)
        dy[..., at["omega"]] = acc[..., 3:6]
        dy[..., at["Delta"]], dy[..., at["q"]] = y[..., at["Delta_dot"]], y[..., at["q_dot"]]
        dy[..., at["Delta_dot"]], dy[..., at["q_dot"]] = acc[..., 6:6 + self.B], acc[..., 6 + self.B:]
        dy[..., at["lost"]] = lost[..., None]
        return dy

    def jacobian(self, y, contact):
        """d rate / dy by complex steps, exact to round-off."""
        step = 1e-30
        return self.rate(y + 1j * step * np.eye(self.size), contact).imag.T / step

    def audit(self, y):
        """Energy (kinetic, stored, lost), linear and angular momentum about the inertial origin, in inertial axes."""
        at = self.at
        quat, R, V, omega, Delta = (y[at[key]] for key in ("quat", "R", "V", "omega", "Delta"))
        p, _, relative, _ = self.points(y)
        v_hub = rotate(quat * [1, -1, -1, -1], V)
        v, dm = v_hub + np.cross(omega, p) + relative, self.dm[..., None]
        kinetic = 0.5 * ((dm * v * v).sum() + self.hub_mass * V @ V + omega @ self.hub_J @ omega)
        springs = self.k_hinge @ Delta**2 + self.P3 * (np.maximum(Delta, 0)**2).sum()
        stored = 0.5 * (springs + self.Ke.ravel() @ y[at["q"]]**2)
        P = rotate(quat, (dm * v).sum((0, 1))) + self.hub_mass * V
        H = rotate(quat, (dm * np.cross(p, v)).sum((0, 1)) + self.hub_J @ omega) + np.cross(R, P)
        return kinetic, stored, y[at["lost"]][0], P, H


def rotate(quat, a):
    """A a for unit quaternions (w, x, y, z)."""
    v = quat[..., 1:]
    t = 2 * np.cross(v, a)
    return a + quat[..., :1] * t + np.cross(v, t)


def rotation_vector(quat):
    quat = quat / np.linalg.norm(quat)
    size = np.linalg.norm(quat[1:])
    return quat[1:] * (2 * np.arctan2(size, quat[0]) / size if size else 2.0)


# ------------------------------------------------------------------------------------------------------ time methods
class Scale:
    """Error scale of each component: its size in this step, kept above a fraction of the largest seen so far."""

    def __init__(self, model, rtol):
        self.group, self.rtol, self.seen = model.group, rtol, np.zeros(model.size)

    def __call__(self, *states):
        now = np.max(np.abs(np.vstack(states)), axis=0)
        together = np.zeros_like(now)
        np.maximum.at(together, self.group, np.maximum(now, 1e-4 * self.seen))
        return self.rtol * np.maximum(np.maximum(now, 1e-4 * self.seen), 1e-2 * together[self.group]) + 1e-30

    def accept(self, *states):
        self.seen = np.maximum(self.seen, np.max(np.abs(np.vstack(states)), axis=0))


class Radau:
    """Radau IIA collocation of order 2 s - 1."""

    def __init__(self, model, rtol, stages=9):
        self.model, self.scale, self.s, self.evaluations = model, Scale(model, rtol), stages, 0
        nodes = np.append((roots_jacobi(stages - 1, 1, 0)[0] + 1) / 2, 1.0)
        legendre = np.polynomial.legendre
        values = legendre.legvander(2 * nodes - 1, stages - 1)
        primitives = [legendre.legint(row, lbnd=-1) for row in np.eye(stages)]
        integrals = np.array([legendre.legval(2 * nodes - 1, row) for row in primitives]).T / 2
        self.A = integrals @ np.linalg.inv(values)                # A_ij = int_0^{c_i} l_j
        self.lam, self.T = np.linalg.eig(self.A)
        self.T_inv, self.nodes = np.linalg.inv(self.T), nodes
        self.to_legendre = np.linalg.inv(legendre.legvander(2 * np.append(0, nodes) - 1, stages))

    def solve(self, y, h, contact, J):
        """Stage increments Z and the scale used, or None when Newton fails."""
        inverse = np.linalg.inv(np.eye(len(y)) - h * self.lam[:, None, None] * J)
        Z, last = h * self.nodes[:, None] * self.model.rate(y, contact), np.inf
        if not np.all(np.abs(Z) < 1 + np.abs(y)):
            Z = np.zeros_like(Z)
        for _ in range(15):
            residual = h * self.A @ self.model.rate(y + Z, contact) - Z
            self.evaluations += self.s
            step = (self.T @ (inverse @ (self.T_inv @ residual)[..., None])[..., 0]).real
            Z += step
            scale = self.scale(y, y + Z)
            size = np.max(np.abs(step) / scale)
            if not np.isfinite(size) or size > 1e3 * last:
                return None
            if size < 1e-3 or (size < 1 and size > 0.1 * last):    # converged, or round-off reached
                return Z, scale
            last = size
        return None

    def step(self, t, y, h, contact, exact=False):
        """One step of length at most h (exactly h if asked): length, new state, interpolant on [0, 1], next length."""
        J = self.model.jacobian(y, contact)
        while True:
            solved = self.solve(y, h, contact, J)
            if solved is None and exact:
                half = self.step(t, y, h / 2, contact, exact=True)[1]
                return h, self.step(t + h / 2, half, h / 2, contact, exact=True)[1], None, h
            if solved is None:
                h /= 2
                continue
            Z, scale = solved
            coefficients = self.to_legendre @ np.vstack([0 * y, Z])
            error = np.max(np.maximum(np.abs(coefficients[-1]), 0.1 * np.abs(coefficients[-2])) / scale)
            factor = np.clip(0.8 * max(error, 1e-30)**(-1 / self.s), 0.2, 4)
            if error <= 1 or exact:
                break
            h *= min(factor, 0.8)
        interpolant = lambda z: y + np.polynomial.legendre.legval(2 * np.asarray(z) - 1, coefficients).T
        return h, y + Z[-1], interpolant, h * factor


class Explicit:
    """DOP853 of scipy, one step per call."""

    def __init__(self, model, rtol):
        self.model, self.scale, self.rtol, self.evaluations = model, Scale(model, rtol), rtol, 0

    def step(self, t, y, h, contact, exact=False):
        now, start = 0.0, y
        while True:
            solver = DOP853(lambda _, v: self.model.rate(v, contact), now, y, h,
                            rtol=self.rtol, atol=self.scale(y), first_step=h - now)
            solver.step()
            self.evaluations += solver.nfev
            if not exact or solver.t >= h:
                break
            now, y = solver.t, solver.y
        interpolant = None if exact else (lambda z: solver.dense_output()(np.asarray(z) * solver.t).T)
        return solver.t, solver.y, interpolant, solver.h_abs


# ------------------------------------------------------------------------------------------------------------ driver
class Run:
    """State of one integration: time, y, contact flags, events."""

    def __init__(self, model, method, degrees):
        self.model, self.method = model, method
        self.t, self.y, self.h = 0.0, model.initial_state(degrees), 1e-7
        self.contact = (self.y[model.at["Delta"]] > 0).astype(float)
        self.followed = np.ones(model.B, bool)
        self.events, self.steps = [], 0

    def first_crossing(self, h, y1, interpolant):
        """(fraction of the step, hinge) of the earliest stop crossing, or None."""
        Delta, rate = self.model.at["Delta"], self.model.at["Delta_dot"]
        side, reach = 2 * self.contact - 1, 2 * h * np.maximum(np.abs(self.y[rate]), np.abs(y1[rate]))
        near = self.followed & (np.minimum(side * self.y[Delta], side * y1[Delta]) <= reach)
        if not near.any():
            return None
        grid = np.linspace(0, 1, 65)
        path = side * interpolant(grid)[:, Delta]
        path[0] = side * self.y[Delta]
        found = []
        for i in np.flatnonzero(near & (path.min(axis=0) < 0)):
            k = int(np.argmax(path[:, i] < 0))
            line = lambda z: float(side[i] * interpolant(z)[Delta][i])
            ends = (grid[k - 1], grid[k]) if k else (0.0, 0.0)
            inside = k > 0 and path[k - 1, i] > 0 and line(ends[0]) > 0
            found.append((brentq(line, *ends, xtol=1e-14) if inside else ends[0], i))
        return min(found) if found else None

    def land_on(self, h, i):
        """Repeat the step so that it ends on the crossing of hinge i, then switch the stop."""
        Delta, rate = self.model.at["Delta"].start + i, self.model.at["Delta_dot"].start + i
        y1 = self.y
        if h > 1e-15:
            for _ in range(3):
                y1 = self.method.step(self.t, self.y, h, self.contact, exact=True)[1]
                if abs(y1[Delta]) < 1e-17 or abs(y1[Delta] / y1[rate]) < 1e-16 * max(self.t, h):
                    break
                h = max(h - y1[Delta] / y1[rate], 0.0)
            self.t, self.y = self.t + h, y1.copy()
        self.y[Delta] = 0
        self.contact[i] = 1 - self.contact[i]
        self.events.append((self.t, self.model.names[i], "contact" if self.contact[i] else "release", self.y[rate]))
        self.followed[i] = abs(self.y[rate]) > SETTLED
        self.h = min(self.h, 1e-4)

    def advance_to(self, t_end):
        """Integrate to t_end; every output time is the end of a step."""
        while t_end - self.t > 1e-14 * t_end:
            wanted = min(self.h, t_end - self.t)
            h, y1, interpolant, proposal = self.method.step(self.t, self.y, wanted, self.contact)
            self.method.scale.accept(self.y, y1)
            self.steps += 1
            crossing = self.first_crossing(h, y1, interpolant)
            if crossing:
                self.land_on(crossing[0] * h, crossing[1])
                continue
            self.t, self.y = self.t + h, y1
            # A step cut short by an output time says nothing against the length wanted before.
            self.h = max(proposal, self.h) if h == wanted < self.h else proposal
        self.t = t_end


def columns(model):
    names = ["t"] + [f"hub.{what}.{axis}" for what in ("rotation", "position", "rate") for axis in "xyz"]
    for name in model.names:
        names += [f"{name}.angle", f"{name}.rate"] + [f"{name}.q{k + 1}" for k in range(model.n)]
    return names


def output_row(model, t, y):
    at = model.at
    row = [t, *rotation_vector(y[at["quat"]]), *y[at["R"]], *y[at["omega"]]]
    q = y[at["q"]].reshape(model.B, model.n)
    for i in range(model.B):
        row += [np.pi / 2 + y[at["Delta"]][i], y[at["Delta_dot"]][i], *q[i]]
    return row


def write_csv(path, header, rows):
    with open(path, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for row in rows:
            writer.writerow([v if isinstance(v, str) else f"{v:.17g}" for v in row])


def print_eigenvalues(model):
    y = model.initial_state(0)
    for label, flag in (("free side", 0.0), ("stop closed", 1.0)):
        lam = np.linalg.eigvals(model.jacobian(y, flag * np.ones(model.B)))
        lam = sorted(lam[np.abs(lam) > 1e-3], key=abs, reverse=True)
        print(f"eigenvalues, {label}:", " ".join(f"{v.real:.4g}{v.imag:+.4g}i" for v in lam if v.imag >= 0))


def print_summary(run, rows, audits):
    model, rows = run.model, np.array(rows)
    total = np.array([a[0] + a[1] + a[2] for a in audits])
    drift = np.max(np.abs(total / total[0] - 1))
    print(f"steps {run.steps}, right-hand sides {run.method.evaluations}")
    print(f"energy: start {total[0]:.17g} J, largest drift (with losses counted) {drift:.3e} relative")
    if not model.fixed_hub:
        for name, k in (("linear", 3), ("angular", 4)):
            drift = max(np.linalg.norm(a[k] - audits[0][k]) for a in audits)
            print(f"{name} momentum drift {drift:.3e} (SI)")
        hub = np.max(np.linalg.norm(rows[:, 7:10] @ model.hub_J, axis=1))
        print(f"largest hub angular momentum {hub:.3e} N m s")
    for i, axis in enumerate("xyz"):
        print(f"max |hub.rotation.{axis}| {np.max(np.abs(rows[:, 1 + i])):.9e} rad")
    for name in model.names:
        print(f"events {name}: {sum(e[1] == name for e in run.events)}")


def simulate(args):
    scene = dict(SCENE)
    if args.conservative:
        scene["P2"] = scene["zeta"] = 0
    if args.zeta is not None:
        scene["zeta"] = args.zeta
    model = Model(scene, args.modes, args.points, args.fixed_hub)
    print_eigenvalues(model)
    method = Radau(model, args.rtol) if args.method == "radau" else Explicit(model, args.rtol)
    run = Run(model, method, scene["start_degrees"] if args.start_degrees is None else args.start_degrees)
    rows, audits = [output_row(model, 0.0, run.y)], [model.audit(run.y)]
    count = round(args.duration / args.step)
    for k in range(1, count + 1):
        run.advance_to(k * args.duration / count)
        rows.append(output_row(model, run.t, run.y))
        audits.append(model.audit(run.y))
        if sys.stderr.isatty():
            print(f"\rt = {run.t:.4g} s, {run.steps} steps", end="", file=sys.stderr)
    out = pathlib.Path(args.out)
    write_csv(out, columns(model), rows)
    write_csv(events_file(out), ["time", "hinge", "kind", "rate"], run.events)
    print_summary(run, rows, audits)
    return 0


# ----------------------------------------------------------------------------------------------------------- compare
def events_file(path):
    return path.with_name(path.stem + "_events.csv")


def read_csv(path):
    """Columns by name; lines starting with # are comments."""
    with open(path, newline="") as file:
        header, *rows = list(csv.reader(line for line in file if not line.startswith("#")))
    data = np.array([[float(v) for v in row] for row in rows])
    return {name: data[:, i] for i, name in enumerate(header)}


def comparison_groups(names):
    """(label, columns, judged): hub vectors as one group, everything else column by column."""
    vectors = ("rotation", "position", "rate")
    groups = [(f"hub.{what}", [f"hub.{what}.{axis}" for axis in "xyz"], what == "rotation") for what in vectors]
    single = [n for n in names if n != "t" and not n.startswith("hub.")]
    return groups + [(n, [n], not n.endswith(".rate")) for n in single]


def compare_events(reference, trajectory):
    """Largest time difference of the k-th events per hinge, where the crossing is faster than 1e-4 rad/s."""
    candidates = (trajectory.with_name("events.csv"), events_file(trajectory))
    theirs_file = next((f for f in candidates if f.exists()), None)
    if not events_file(reference).exists() or theirs_file is None:
        return
    tables = [list(csv.DictReader(f.read_text().splitlines())) for f in (events_file(reference), theirs_file)]
    for hinge in dict.fromkeys(e["hinge"] for e in tables[0]):
        ours, theirs = ([e for e in table if e["hinge"] == hinge] for table in tables)
        fast = [k for k, e in enumerate(ours) if abs(float(e["rate"])) > 1e-4]
        pairs = [(ours[k], theirs[k]) for k in fast if k < len(theirs)]
        same = len(pairs) == len(fast) and all(a["kind"] == b["kind"] for a, b in pairs)
        worst = max((abs(float(a["time"]) - float(b["time"])) for a, b in pairs), default=0.0)
        note = "" if same else ", SEQUENCE DIFFERS"
        counts = f"{len(fast)} fast ones of {len(ours)}; here {len(theirs)}{note}"
        print(f"{'events ' + hinge:24s} {worst:.3e} s over {counts}")


def group_error(ref, mine, names, index, here):
    """max_t |y - y_ref| / max_t |y_ref|; an angle is measured from its start. Infinite if not a number."""
    if any(n not in mine for n in names):
        return np.inf
    a, b = (np.array([data[n] for n in names]) for data in (ref, mine))
    origin = a[:, :1] if names[0].endswith(".angle") else 0.0
    error = np.max(np.linalg.norm((b[:, index] - a)[:, here], axis=0)) / np.max(np.linalg.norm(a - origin, axis=0))
    return error if np.isfinite(error) else np.inf


def compare(args):
    reference, trajectory = (pathlib.Path(p) for p in args.compare)
    ref, mine = read_csv(reference), read_csv(trajectory)
    index = np.array([int(np.argmin(np.abs(mine["t"] - t))) for t in ref["t"]])
    here = np.abs(mine["t"][index] - ref["t"]) < 1e-9
    if not here.any() or not (args.partial or here.all()):
        print(f"{np.count_nonzero(~here)} of {len(here)} reference times are missing in {trajectory}")
        return 1
    worst = 0.0
    for label, names, judged in comparison_groups(ref):
        error = group_error(ref, mine, names, index, here)
        worst = max(worst, error) if judged else worst
        print(f"{label:24s} {error:.3e}{'' if judged else '   (not judged)'}")
    compare_events(reference, trajectory)
    verdict = "passed" if worst <= args.tolerance else "FAILED"
    times = np.count_nonzero(here)
    print(f"largest judged error {worst:.3e}, tolerance {args.tolerance:.1e}, {times} times: {verdict}")
    return 0 if worst <= args.tolerance else 1


def main():
    parser = argparse.ArgumentParser(description="Independent integration of SPORT, and comparison of two trajectories")
    parser.add_argument("--out", help="trajectory to write; events go to the same name with _events")
    parser.add_argument("--duration", type=float, default=10.0, help="s")
    parser.add_argument("--step", type=float, default=0.01, help="output step, s")
    parser.add_argument("--modes", type=int, default=2, help="in-plane shapes per boom")
    parser.add_argument("--points", type=int, default=32, help="mass points per boom")
    parser.add_argument("--rtol", type=float, default=1e-11)
    parser.add_argument("--method", choices=("radau", "dop853"), default="radau")
    parser.add_argument("--conservative", action="store_true", help="no hinge damper, no structural damping")
    parser.add_argument("--zeta", type=float, help="structural damping ratio instead of the scene's")
    parser.add_argument("--start-degrees", type=float, help="hinge angle minus 90 degrees at the start")
    parser.add_argument("--fixed-hub", action="store_true")
    parser.add_argument("--compare", nargs=2, metavar=("REFERENCE", "TRAJECTORY"))
    parser.add_argument("--tolerance", type=float, default=1e-7)
    parser.add_argument("--partial", action="store_true", help="compare at the reference times the trajectory has")
    args = parser.parse_args()
    if args.compare:
        return compare(args)
    if args.out:
        return simulate(args)
    parser.print_help()
    return 2


if __name__ == "__main__":
    sys.exit(main())
