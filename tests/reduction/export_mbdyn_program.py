"""Loads what `flexboom export --to mbdyn` writes into MBDyn itself and compares its motion with the body.

    export_mbdyn_program.py FLEXBOOM FOLDER      exit code 77 (skipped) when there is no `mbdyn` on the PATH

1. Clamped, a force steps on at the tip: MBDyn's trapezoidal rule against the same rule applied here to Me, De, Ke of the
   body: no error of time in it. Its steps turn each mode by 2 atan(omega h / 2), so this is the check of frequencies.
2. A free hub that carries the body, spinning and vibrating, q up to a twentieth of the body's size: hub, attitude, q and tip against an
   integration of eqs. 7-9 from the invariants of the body file; the time error of MBDyn taken off by step halving.
SI units; z = (R, attitude, q); MBDyn's angular velocity is in inertial axes, omega here in BRF axes."""
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

SKIPPED = 77
HUB_M, HUB_J = 1.0, np.diag([0.02, 0.03, 0.04])  # rigid, centred at the origin of the body: the modal node carries it


def bent_deck(parts=6):
    """Abaqus deck: three beams at right angles, clamped at the origin, a mass beside the tip. No integral is zero."""
    corners = np.array([[0, 0, 0], [0.4, 0, 0], [0.4, 0.3, 0], [0.4, 0.3, 0.25]])
    points = [corners[0]]
    for a, b in zip(corners, corners[1:]):
        points += [a + (b - a) * (i + 1) / parts for i in range(parts)]
    tip = len(points)
    points.append([0.43, 0.25, 0.27])
    text = "*NODE\n" + "".join(f"{i + 1}, {x:.17g}, {y:.17g}, {z:.17g}\n" for i, (x, y, z) in enumerate(points))
    sections = (("0.012, 0.02", "0,1,0"), ("0.01, 0.014", "0,0,1"), ("0.011, 0.011", "1,0,0"))
    for k, (size, axis) in enumerate(sections):
        leg = range(k * parts + 1, (k + 1) * parts + 1)
        text += f"*ELEMENT, TYPE=B31, ELSET=LEG{k}\n" + "".join(f"{j}, {j}, {j + 1}\n" for j in leg)
        text += f"*BEAM SECTION, ELSET=LEG{k}, MATERIAL=AL, SECTION=RECT\n{size}\n{axis}\n"
    return text + (f"*ELEMENT, TYPE=MASS, ELSET=PROBE\n1000, {tip + 1}\n*MASS, ELSET=PROBE\n0.15\n*MPC\n"
                   f"BEAM, {tip + 1}, {tip}\n*MATERIAL, NAME=AL\n*ELASTIC\n67e9, 0.33\n*DENSITY\n2840\n"
                   f"*NSET, NSET=root\n1\n*NSET, NSET=tip\n{tip}\n*BOUNDARY\nroot, 1, 6\n")


class Body:
    """Invariants of a body file (reduction/README.md, section 4)."""

    def __init__(self, path):
        with h5py.File(path, "r") as file:
            for name in ("m", "mc0", "J0", "Ct", "Cr0", "Cr1", "Me", "Ke", "De", "J1", "J2"):
                setattr(self, name, file[name][()])
            names = [n.decode() for n in file["markers/name"][()]]
            tip = names.index("tip")
            self.tip, self.S, self.S_theta = (file["markers/" + n][tip] for n in ("position", "S", "S_theta"))
        self.n = len(self.Me)

    def rates(self, state, n):
        """d/dt of (R, quaternion x y z w, q, V, omega, q_dot) in free flight: eqs. 7-9, eq. 8 corrected (dynamics/README.md)."""
        quaternion, q = state[3:7], state[7:7 + n]
        V, w, q_dot = state[7 + n:10 + n], state[10 + n:13 + n], state[13 + n:]
        A = Rotation.from_quat(quaternion).as_matrix()
        m, mc = self.m + HUB_M, self.mc0 + self.Ct @ q
        J = HUB_J + self.J0 + np.einsum("kij,k", self.J1, q) + np.einsum("klij,k,l", self.J2, q, q)
        J_k = self.J1 + 2 * np.einsum("klij,l->kij", self.J2, q)
        Cr = self.Cr0 + np.einsum("kij,k", self.Cr1, q)
        t = tilde(mc)
        M = np.block([[m * np.eye(3), -A @ t, A @ self.Ct], [t @ A.T, J, Cr], [self.Ct.T @ A.T, Cr.T, self.Me]])
        Q = np.concatenate([
            -A @ (np.cross(w, np.cross(w, mc)) + 2 * np.cross(w, self.Ct @ q_dot)),
            -np.cross(w, J @ w) - np.einsum("kij,k", J_k, q_dot) @ w - np.cross(w, Cr @ q_dot),
            np.einsum("kij,i,j", J_k, w, w) / 2 + 2 * np.einsum("kil,i,l", self.Cr1, w, q_dot)
            - self.Ke @ q - self.De @ q_dot])
        x, y, z, s = quaternion
        turn = 0.5 * np.array([[s, -z, y], [z, s, -x], [-y, x, s], [-x, -y, -z]]) @ w
        return np.concatenate([V, turn, q_dot, np.linalg.solve(M, Q)])


def tilde(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def numbers(values):
    return ", ".join(f"{x:.17g}" for x in np.ravel(values))


DECK = """begin: data;
  problem: initial value;
end: data;
begin: initial value;
  initial time: 0.;
  final time: {final:.17g};
  time step: {step:.17g};
  method: crank nicolson;
  tolerance: 1e-8;
  max iterations: 100;
  derivatives tolerance: 1e-4; # the coefficient times the speed of the nodes is left
  derivatives coefficient: 1e-6;
  derivatives max iterations: 50;
end: initial value;
begin: control data;
  structural nodes: {nodes};
  joints: 1;
  rigid bodies: {bodies};
  forces: {forces};
  skip initial joint assembly;
  output precision: 16;
  default orientation: orientation matrix;
end: control data;
begin: nodes;
{node_cards}end: nodes;
begin: elements;
{element_cards}end: elements;
"""


class Program:
    """MBDyn with one flexible body."""

    def __init__(self, folder, fem, joint_card, modes):
        self.folder, self.fem, self.joint_card, self.modes = folder, fem, joint_card, modes

    def run(self, name, node_cards, modal_node, load, final, steps, q_dot=None):
        """Rows per step: motions of the nodes {label: (position, orientation)} and q."""
        text = self.fem.read_text()
        if q_dot is not None:
            text = re.sub(r"(RECORD GROUP 4,.*\n).*\n", lambda m: m[1] + numbers(q_dot).replace(",", "") + "\n", text)
        (self.folder / f"{name}.fem").write_text(text)
        joint = self.joint_card.replace("MODAL_bent", modal_node).replace(self.fem.name, f"{name}.fem")
        joint = joint.replace("JOINT_bent", "1").replace("NODE_bent_tip", "2")
        deck = DECK.format(final=final, step=final / steps, nodes=node_cards.count("structural:"),
                           forces=load.count("force:"), bodies=load.count("body:"), node_cards=node_cards,
                           element_cards=joint + load)
        (self.folder / f"{name}.mbd").write_text(deck)
        result = subprocess.run(["mbdyn", "-s", "-f", f"{name}.mbd", "-o", name], cwd=self.folder, text=True,
                                capture_output=True, timeout=600)
        assert result.returncode == 0, result.stdout[-2000:] + result.stderr[-2000:]
        self.messages = result.stdout + result.stderr
        modes = np.array([line.split()[1] for line in (self.folder / f"{name}.mod").read_text().splitlines()
                          if line.split()[0].startswith("1.")], dtype=float)
        rows = np.loadtxt(self.folder / f"{name}.mov", ndmin=2)
        # Round-off of its time may give it one step more.
        motions = {label: rows[rows[:, 0] == label][:steps + 1, 1:13] for label in np.unique(rows[:, 0]).astype(int)}
        return motions, modes.reshape(-1, self.modes)[:steps + 1]


def relative(a, b):
    """Largest difference over time, divided by the largest value."""
    return np.max(np.abs(a - b)) / np.max(np.abs(b))


def clamped_step(program, body, force=(0.3, -0.5, 0.4), final=0.1, steps=500):
    """Errors of q and tip against the trapezoidal rule, and MBDyn's time error against the exact motion."""
    node = f"  structural: 2, static, {numbers(body.tip)}, eye, null, null;\n"
    card = f"  force: 1, absolute, 2, position, null, {numbers(force)}, const, 1.;\n"
    motions, q = program.run("clamped", node, "clamped", card, final, steps)
    n, h = body.n, final / steps
    load = np.linalg.solve(body.Me, body.S.T @ force)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(body.Me, np.hstack([body.Ke, body.De]))]])
    rest = -np.linalg.solve(A, np.concatenate([np.zeros(n), load]))
    one_step = np.linalg.solve(np.eye(2 * n) - h / 2 * A, np.eye(2 * n) + h / 2 * A)

    def motion(propagator):
        x, rows = -rest, [np.zeros(n)]
        for _ in range(len(q) - 1):
            x = propagator @ x
            rows.append((x + rest)[:n])
        return np.array(rows)

    rule = motion(one_step)
    tip = body.tip + rule @ body.S.T
    return {"q": relative(q, rule), "tip": relative(motions[2][:, :3] - body.tip, tip - body.tip),
            "time": relative(q, motion(expm(h * A)))}


def free_flight(program, body, final=0.2, steps=800, omega=(2.0, -3.0, 4.0)):
    """Errors of hub, attitude, q and tip: of `steps` steps, of twice as many, and of both extrapolated."""
    omega, V = np.array(omega), np.array([0.1, -0.2, 0.3])
    q_dot = np.zeros(body.n)
    q_dot[:4] = (1.2, -1.0, 0.8, 0.6)
    nodes = (f"  structural: 1, modal, null, eye, {numbers(V)}, {numbers(omega)};\n"
             f"  structural: 2, static, {numbers(body.tip)}, eye, "
             f"{numbers(V + np.cross(omega, body.tip) + body.S @ q_dot)}, {numbers(omega)};\n")
    hub = f"  body: 1, 1, {HUB_M}, null, diag, {numbers(np.diag(HUB_J))};\n"
    start = np.concatenate([np.zeros(3), [0, 0, 0, 1], np.zeros(body.n), V, omega, q_dot])
    times = np.linspace(0, final, steps + 1)
    y = solve_ivp(lambda t, s: body.rates(s, body.n), (0, final), start, "DOP853", times, rtol=1e-11, atol=1e-13).y.T
    q = y[:, 7:7 + body.n]
    attitude = Rotation.from_quat(y[:, 3:7]).as_matrix()
    tip = y[:, :3] + np.einsum("tij,tj->ti", attitude, body.tip + q @ body.S.T)
    exact = {"hub": y[:, :3], "attitude": attitude.reshape(-1, 9), "q": q, "tip": tip}

    def seen(factor):
        motions, modes = program.run(f"free{factor}", nodes, "1", hub, final, steps * factor, q_dot)
        every = slice(None, None, factor)
        return {"hub": motions[1][every, :3], "attitude": motions[1][every, 3:12], "q": modes[every],
                "tip": motions[2][every, :3]}

    coarse, fine = seen(1), seen(2)
    return {key: (relative(coarse[key], exact[key]), relative(fine[key], exact[key]),
                  relative((4 * fine[key] - coarse[key]) / 3, exact[key])) for key in exact}


def joint_card(path):
    """The joint of the template that goes with the file, the root node left out: nothing is joined there."""
    text = path.with_suffix(".modal").read_text()
    text = re.sub(r'\n  # at [^\n]*\n  "root"[^\n]*', "", text).replace("  2,\n", "  1,\n")
    return re.sub(r"#[^\n]*", "", text)


def main(flexboom, folder):
    if shutil.which("mbdyn") is None:
        print("skipped: no mbdyn on the PATH (Debian 12 has no package; https://www.mbdyn.org)")
        return SKIPPED
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "bent.inp").write_text(bent_deck())
    for arguments in (("reduce", "bent.inp", "--count", "6", "--damping", "rayleigh:0.3,2e-5", "-o", "bent.h5"),
                      ("export", "bent.h5", "--to", "mbdyn", "-o", "bent.fem")):
        subprocess.run([flexboom, *arguments, "--quiet"], cwd=folder, check=True, timeout=300)
    body = Body(folder / "bent.h5")
    program = Program(folder, folder / "bent.fem", joint_card(folder / "bent.fem"), body.n)
    clamped = clamped_step(program, body)
    print("clamped, step of force:", {k: f"{v:.1e}" for k, v in clamped.items()})
    free = free_flight(program, body)
    for key, errors in free.items():
        print(f"free flight, {key}: " + " ".join(f"{e:.1e}" for e in errors))
    # Newton stops at a residual of 1e-8 in N and N m, of loads of the order of 1; reached: 8e-9.
    assert clamped["q"] < 1e-7 and clamped["tip"] < 1e-7, clamped
    for key, (coarse, fine, extrapolated) in free.items():
        # Second order: halving the step divides the error by four. What extrapolation leaves is of fourth order: another
        # halving divides it by 16, down to 3e-6 of q and 4e-8 of the tip at 3200 steps.
        assert 3.5 < coarse / fine < 4.5, (key, coarse, fine)
        assert extrapolated < min(coarse / 30, 1e-4), (key, extrapolated)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2])))
