"""Bodies exported to EXUDYN, loaded and moved by EXUDYN itself: frequencies, a load at the tip with the frame held,
free flight with spin. Compared with what the body file says, by routes that share nothing with the export.

    exudyn_motion.py FLEXBOOM FOLDER [BODY ...]      returns 77 when `import exudyn` fails (set PYTHONPATH)
"""
import subprocess
import sys
from pathlib import Path

try:
    import exudyn
    import exudyn.itemInterface as items
    from exudyn.advancedUtilities import LoadDictFromHDF5
    from exudyn.FEM import ObjectFFRFreducedOrderInterface
except ImportError as fault:
    print(f"SKIPPED: EXUDYN is not here ({fault})")
    sys.exit(77)

import h5py
import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, expm
from scipy.spatial.transform import Rotation

BAR = """format = "flexboom-body-1"
name = "boom"
directions = "all"
[[segments]]
shape = "round-bar"
diameter = {}
length = {}
material = {{ E = 67e9, nu = 0.33, rho = 2840.0 }}
"""
# No integral vanishes by symmetry.
SKEW = """format = "flexboom-body-1"
name = "skew"
directions = "all"
order = 6
damping = { rule = "modal", value = 0.01 }
[[segments]]
shape = "round-bar"
diameter = 0.010
end = { diameter = 0.006 }
length = 0.400
elements = 4
material = { E = 67e9, nu = 0.33, rho = 2840.0 }
[[attachments]]
name = "head"
position = "tip"
mass = 0.050
inertia = [3.0e-5, 4.0e-5, 5.0e-5]
offset = [0.020, 0.015, -0.010]
"""
BODIES = {"boom2": (BAR.format(0.005, 0.295), []), "skew": (SKEW, []),
          "boom4_solid": (BAR.format(0.010, 0.302), ["--structure", "solid"]),
          "skew_mean_axis": (SKEW, ["--basis", "mean-axis"])}


def cross(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


STEPS = 4000  # of the coarsest of three flights
# Largest differences by largest values. What is left is the error of EXUDYN's time steps, of order 6 after
# extrapolation: held, h omega of the fastest mode is below 0.1; free, the fastest mode of "boom2" is at 1.3 kHz,
# h omega 0.05, and the angular velocity has most of it. Reached: held 1e-8, free 6e-8. Wrong integrals make 1e-4 and more.
HELD, FLIGHT = 1e-7, 5e-7
TILDE = np.array([cross(e).ravel() for e in np.eye(3)])  # a @ TILDE = cross(a), row by row


class Body:
    """The reduced body of a body file, and its motion from the matrix sum dm z z^T, z = (1, u0, S_1, ..., S_n): as
    points of which the columns of its root are the z, so that none of the invariants in the export is used."""

    def __init__(self, path):
        with h5py.File(path, "r") as file:
            self.Me, self.Ke, self.De = (file[name][()] for name in ("Me", "Ke", "De"))
            gram = file["gram"][()]
            names = [name.decode() for name in file["markers/name"][()]]
            tip = names.index("tip")
            self.position = file["markers/position"][tip]
            self.S, self.S_theta = file["markers/S"][tip], file["markers/S_theta"][tip]
            self.clamped = np.max(np.abs(file["markers/S"][names.index("root")])) < 1e-12 * np.max(np.abs(self.S))
        self.n = len(self.Me)
        values, vectors = np.linalg.eigh(gram)
        z = (vectors * np.sqrt(np.maximum(values, 0))).T
        self.one, self.x = z[:, 0], z[:, 1:4]
        self.shapes = z[:, 4:].reshape(len(z), self.n, 3).transpose(0, 2, 1)  # points x 3 x n

    def frequencies(self):
        return np.sqrt(eigh(self.Ke, self.Me, eigvals_only=True)) / (2 * np.pi)

    def held(self, f, times):
        """q of the body with its frame held, a modal force f acting from t = 0 on: Me q'' + De q' + Ke q = f."""
        n = self.n
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(self.Me, D) for D in (self.Ke, self.De)]])
        rest = np.concatenate([np.linalg.solve(self.Ke, f), np.zeros(n)])
        return np.array([(rest - expm(A * t) @ rest)[:n] for t in times])

    def rate(self, state):
        n = self.n
        p, q, v, omega, q_dot = np.split(state[3:], np.cumsum([4, n, 3, 3]))
        u, u_dot = self.x + self.shapes @ q, self.shapes @ q_dot
        L = np.empty((len(u), 3, 6 + n))  # velocity of a point, in axes of the body: L (A^T v, omega, q_dot)
        L[:, :, :3] = self.one[:, None, None] * np.eye(3)
        L[:, :, 3:6] = -(u @ TILDE).reshape(-1, 3, 3)
        L[:, :, 6:] = self.shapes
        L = L.reshape(-1, 6 + n)
        W = cross(omega)
        force = -L.T @ (u @ (W @ W).T + 2 * u_dot @ W.T).ravel()
        force[6:] -= self.Ke @ q + self.De @ q_dot
        acceleration = np.linalg.solve(L.T @ L, force)
        A = Rotation.from_quat(p[[1, 2, 3, 0]]).as_matrix()
        p_dot = np.concatenate([[-p[1:] @ omega], p[0] * omega + cross(p[1:]) @ omega]) / 2
        return np.concatenate([v, p_dot, q_dot, A @ acceleration[:3], acceleration[3:]])

    def flight(self, q, v, omega, q_dot, times):
        """States (R, p, q, v, omega, q_dot), omega in axes of the body."""
        start = np.concatenate([[0, 0, 0, 1, 0, 0, 0], q, v, omega, q_dot])
        run = solve_ivp(lambda _, state: self.rate(state), (0, times[-1]), start, "DOP853", times,
                        rtol=1e-11, atol=1e-13)
        assert run.success, run.message
        return run.y.T


class Exudyn:
    """The export of the body in a system of EXUDYN."""

    def __init__(self, path, **motion):
        self.container = exudyn.SystemContainer()
        self.mbs = self.container.AddSystem()
        cms = ObjectFFRFreducedOrderInterface()
        cms.LoadFromFile(str(path), mode="HDF5")
        self.added = cms.AddObjectFFRFreducedOrder(self.mbs, **motion)
        self.extra = LoadDictFromHDF5(str(path))
        damping = exudyn.MatrixContainer()
        damping.SetWithDenseMatrix(self.extra["dampingMatrixReduced"])
        self.mbs.SetObjectParameter(self.added["oFFRFreducedOrder"], "dampingMatrixReduced", damping)

    def marker(self, name, **options):
        nodes = list(self.extra["markerNodes"][self.extra["markerNames"].index(name)])
        return self.mbs.AddMarker(items.MarkerSuperElementRigid(
            bodyNumber=self.added["oFFRFreducedOrder"], meshNodeNumbers=nodes, weightingFactors=[1 / 6] * 6, **options))

    def hold(self):
        """The frame, by the marker at the root."""
        ground = self.mbs.AddObject(items.ObjectGround())
        place = self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ground))
        self.mbs.AddObject(items.GenericJoint(markerNumbers=[place, self.marker("root")], constrainedAxes=[1] * 6))

    def sensor(self, add, what, **of):
        return self.mbs.AddSensor(add(outputVariableType=what, storeInternal=True, writeToFile=False, **of))

    def run(self, end, steps, outputs, sensors):
        """Values of the sensors at `outputs` equidistant times after 0. Trapezoidal rule, constraints by velocities."""
        settings = exudyn.SimulationSettings()
        time = settings.timeIntegration
        time.endTime, time.numberOfSteps = end, steps
        time.generalizedAlpha.useNewmark = True
        time.generalizedAlpha.useIndex2Constraints = True
        time.generalizedAlpha.computeInitialAccelerations = True
        time.newton.relativeTolerance, time.newton.absoluteTolerance = 1e-11, 1e-13
        time.verboseMode = 0
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = end / outputs
        self.mbs.SolveDynamic(settings)
        data = [self.mbs.GetSensorStoredData(s)[-outputs:] for s in sensors]
        times = np.arange(1, outputs + 1) * end / outputs
        assert all(np.allclose(d[:, 0], times, rtol=0, atol=1e-9 * end) for d in data)
        return [d[:, 1:] for d in data]


def extrapolated(make, end, steps, outputs):
    """Richardson's rule twice, for a symmetric method of order 2, from three runs with steps halved; and by how much
    the differences between them fall, 4 when the order is 2."""
    a, b, c = (make().run(end, steps * k, outputs) for k in (1, 2, 4))
    fall = max(np.max(np.abs(y - x)) for x, y in zip(a, b)) / max(np.max(np.abs(y - x)) for x, y in zip(b, c))
    return [(64 * z - 20 * y + x) / 45 for x, y, z in zip(a, b, c)], fall


def compare(what, value, reference, tolerance):
    """Largest difference by the largest value of the reference."""
    error = np.max(np.abs(np.asarray(value) - reference)) / np.max(np.abs(reference))
    print(f"  {what:<58} {error:8.1e}  {'ok' if error < tolerance else f'MORE THAN {tolerance}'}")
    return error < tolerance


def frequencies_agree(body, path):
    system = Exudyn(path)
    if body.clamped:
        system.hold()
    system.mbs.Assemble()
    values = np.asarray(system.mbs.ComputeODE2Eigenvalues(convert2Frequencies=True)[0])
    return compare("frequencies", values[-body.n:], body.frequencies(), 1e-12)  # round-off of two dense eigen-solves


def held_motion_agrees(body, path):
    """A force and a torque at the tip, none of their components zero, from t = 0 on: two periods of the first mode."""
    end, outputs = 2 / body.frequencies()[0], 100
    size = 0.05 / np.linalg.norm(body.S @ np.linalg.solve(body.Ke, body.S.T), 2)  # moves the tip by centimetres
    force = size * np.array([0.5, 1.0, -0.7])
    torque = 0.05 * size * np.array([-0.6, 0.4, 1.0])

    class Run:
        def run(self, end, steps, outputs):
            system = Exudyn(path)
            system.hold()
            # Rotations of markers are linear in q, as in the body.
            tip = system.marker("tip", rotationsExponentialMap=0)
            system.mbs.AddLoad(items.LoadForceVector(markerNumber=tip, loadVector=list(force)))
            system.mbs.AddLoad(items.LoadTorqueVector(markerNumber=tip, loadVector=list(torque)))
            kinds = exudyn.OutputVariableType
            sensors = [system.sensor(items.SensorMarker, kinds.Displacement, markerNumber=tip),
                       system.sensor(items.SensorMarker, kinds.RotationMatrix, markerNumber=tip),
                       system.sensor(items.SensorNode, kinds.Coordinates, nodeNumber=system.added["nGenericODE2"])]
            system.mbs.Assemble()
            return system.run(end, steps, outputs, sensors)

    (u, rotation, q), ratio = extrapolated(Run, end, STEPS // 4, outputs)
    times = np.arange(1, outputs + 1) * end / outputs
    exact = body.held(body.S.T @ force + body.S_theta.T @ torque, times)
    A = rotation.reshape(-1, 3, 3)  # I + tilde(S_theta q)
    theta = np.array([[a[2, 1] - a[1, 2], a[0, 2] - a[2, 0], a[1, 0] - a[0, 1]] for a in A]) / 2
    print(f"  steps halved: differences fall by {ratio:.2f}")
    return all([compare("frame held: displacement of the tip", u, exact @ body.S.T, HELD),
                compare("frame held: rotation of the tip", theta, exact @ body.S_theta.T, HELD),
                compare("frame held: modal coordinates", q, exact, HELD)])


def flight_agrees(body, path):
    """Free flight, more than a radian of spin, with all modes at work: one period of the first."""
    end, outputs = 1 / body.frequencies()[0], 100
    omega = np.array([0.6, -1.0, 0.8]) * body.frequencies()[0]
    v = np.array([0.3, -0.2, 0.1])
    amplitude = 0.02 / np.linalg.norm(body.S, axis=0)
    q = amplitude / (1 + np.arange(body.n)) ** 2
    q_dot = 2 * np.pi * body.frequencies() * np.roll(q, 1) * (-1.0) ** np.arange(body.n)

    class Run:
        def run(self, end, steps, outputs):
            system = Exudyn(path, initialVelocity=list(v), initialAngularVelocity=list(omega))
            modes = system.added["nGenericODE2"]
            system.mbs.SetNodeParameter(modes, "initialCoordinates", list(q))
            system.mbs.SetNodeParameter(modes, "initialCoordinates_t", list(q_dot))
            frame, kinds = system.added["nRigidBody"], exudyn.OutputVariableType
            sensors = [system.sensor(items.SensorNode, kind, nodeNumber=frame)
                       for kind in (kinds.Displacement, kinds.RotationMatrix, kinds.AngularVelocityLocal)]
            sensors.append(system.sensor(items.SensorNode, kinds.Coordinates, nodeNumber=modes))
            sensors.append(system.sensor(items.SensorMarker, kinds.Position, markerNumber=system.marker("tip")))
            system.mbs.Assemble()
            return system.run(end, steps, outputs, sensors)

    (R, A, rate, modal, tip), ratio = extrapolated(Run, end, STEPS, outputs)
    states = body.flight(q, v, omega, q_dot, np.arange(1, outputs + 1) * end / outputs)
    R0, p, q0, _, rate0, _ = np.split(states, np.cumsum([3, 4, body.n, 3, 3]), axis=1)
    A0 = Rotation.from_quat(p[:, [1, 2, 3, 0]]).as_matrix()
    tip0 = R0 + np.einsum("tij,tj->ti", A0, body.position + q0 @ body.S.T)
    print(f"  steps halved: differences fall by {ratio:.2f}")
    return all([compare("free flight: position of the frame", R, R0, FLIGHT),
                compare("free flight: rotation matrix of the frame", A.reshape(-1, 3, 3), A0, FLIGHT),
                compare("free flight: angular velocity", rate, rate0, FLIGHT),
                compare("free flight: modal coordinates", modal, q0, FLIGHT),
                compare("free flight: position of the tip", tip, tip0, FLIGHT)])


def main():
    program, folder = sys.argv[1], Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    passed = True
    for name, (text, options) in BODIES.items():
        if name not in (sys.argv[3:] or BODIES):
            continue
        source, body_file, export = (folder / f"{name}{end}" for end in (".toml", ".h5", ".hdf5"))
        source.write_text(text)
        subprocess.run([program, "reduce", source, "--quiet", "--count", "4", *options, "-o", body_file], check=True)
        subprocess.run([program, "export", body_file, "--quiet", "--to", "exudyn", "-o", export], check=True)
        body = Body(body_file)
        print(f"{name}: {body.n} coordinates, first {body.frequencies()[0]:.2f} Hz")
        for test in (frequencies_agree, held_motion_agrees, flight_agrees):
            if test is not held_motion_agrees or body.clamped:
                passed = test(body, export) and passed
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
