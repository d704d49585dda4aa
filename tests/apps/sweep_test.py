"""Sweeps: which values, what survives a kill, shards, failures, results. Usage: sweep_test.py PROGRAM [unittest arguments]"""

import concurrent.futures
import contextlib
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
import unittest
import xml.etree.ElementTree as ElementTree

import h5py
import numpy as np

import cli_test as cli
from cli_test import INPUT, INTERRUPTED, NUMERICAL, OK, USAGE, flexboom

SHORT = ("--vary", "duration=0.05", "--vary", "accuracy.tolerance=1e-3")  # milliseconds per run
POINTING = ("--quantity", "hub.rotation:max")


class Case(cli.Case):
    def sweep(self, *arguments, out="out", code=OK):
        folder = self.folder / out
        result = flexboom("sweep", "sport", *SHORT, *arguments, "--out", folder)
        self.assert_exit(code, result)
        return folder

    def table(self, folder):
        """Columns of sweep.csv as lists of texts by name."""
        rows = cli.read_csv(folder / "sweep.csv")
        return dict(zip(rows[0], map(list, zip(*rows[1:]))))

    def numbers(self, folder, name):
        return np.array(self.table(folder)[name], float)

    def bytes(self, folder):
        return (folder / "sweep.csv").read_bytes()


class Keys(Case):
    def refused(self, *arguments, words, code=INPUT):
        folder = self.folder / "none"
        result = flexboom("sweep", "sport", *arguments, "--out", folder)
        self.assert_exit(code, result)
        for word in words:
            self.assertIn(word, result.stderr)
        self.assertFalse(folder.exists())

    def test_unknown_key_is_refused_with_the_nearest(self):
        self.refused("--vary", "hub.mas=8,9", words=("hub.mas", 'did you mean "mass"'))
        self.refused("--vary", "acuracy.tolerance=1e-3", words=('did you mean "accuracy"',))
        self.refused("--vary", "hinges.sipp.P2=0.01", words=('did you mean "sip"', '"slp"'))
        self.refused("--vary", "bodies.sip.segments[0].material.e=1", words=('did you mean "E"',))

    def test_faults_of_a_specification(self):
        for vary, word in (("hub.mass", "KEY=SPEC"), ("hub.mass=", "KEY=SPEC"), ("hub.mass=lin:1:2", "lin:FIRST"),
                           ("hub.mass=log:-1:1:3", "positive"), ("hub.mass=nomal:1:2", 'did you mean "normal"'),
                           ("hub.mass=normal:8:-1", "negative"), ("hub.mass=uniform:9:8", "above"),
                           ("hub.mass=1,,2", "empty")):
            self.refused("--vary", vary, "-n", "2", "--sample", "random", words=(word,), code=USAGE)

    def test_faults_of_a_path(self):
        for vary, word in (("hinges[7].P2=1", "4 entries"), ("hinges[x].P2=1", "[*]"), ("hub..mass=1", "empty"),
                           ("hub.mass.x=1", "no table"), ("hinges.sip.start_rate*=1,2", "no number"),
                           ("hub.mass=-1,-2", "must be positive"),
                           ("bodies.sip.file=other.toml", "its keys can be varied")):
            self.refused("--vary", vary, "-n", "2", "--sample", "random", words=(word,))

    def test_no_key_is_varied_twice(self):
        self.refused("--vary", "hinges[*].P2=0.01", "--vary", "hinges.sip.P2=0.02", words=("varied already",))
        self.refused("--vary", "hub.inertia*=1,2", "--vary", "hub.inertia[0][0]=1", words=("varied already",))

    def test_number_of_runs_and_sampling_must_fit(self):
        for arguments, word in ((("hub.mass=8,9", "-n", "3"), "-n"), (("hub.mass=normal:8:1",), "-n"),
                                (("hub.mass=normal:8:1", "--sample", "grid"), "lists"),
                                (("hub.mass=8,9", "--indices", "--sample", "lhs", "-n", "4"), "sobol")):
            self.refused("--vary", *arguments, words=(word,), code=USAGE)
        self.refused(words=("--vary",), code=USAGE)

    def test_unknown_output_is_refused_with_the_nearest(self):
        self.refused("--vary", "hub.mass=8,9", "--quantity", "sip.angel:max", words=('did you mean "sip.angle"',))
        self.refused("--vary", "hub.mass=8,9", "--quantity", "sip.angle:mean", words=("COLUMN:rms",), code=USAGE)

    def test_usage(self):
        self.assert_exit(USAGE, flexboom("sweep", "sport", "--vary", "hub.mass=8", "--jobs", "0"))
        result = flexboom("sweep", "--help")
        self.assert_exit(OK, result)
        for word in ("lin:FIRST:LAST:COUNT", "as likely", "n*(d+2)", "settle:COLUMN:FRACTION"):
            self.assertIn(word, " ".join(result.stdout.split()))


class Values(Case):
    def test_grid_has_every_combination(self):
        folder = self.sweep("--vary", "hub.mass=8,9", "--vary", "hinges.sip.P2=lin:0.01:0.03:3", *POINTING)
        self.assertEqual(self.table(folder)["run"], [str(i) for i in range(6)])
        np.testing.assert_array_equal(self.numbers(folder, "hub.mass"), [8, 8, 8, 9, 9, 9])
        np.testing.assert_allclose(self.numbers(folder, "hinges.sip.P2"), [0.01, 0.02, 0.03] * 2, rtol=1e-15)

    def test_draws_have_their_moments(self):
        """Each bound is five standard deviations of its estimate."""
        n = 256  # a power of two: the points of Sobol are then as even as they can be
        for sample, exact in (("random", False), ("lhs", True), ("sobol", True)):
            folder = self.sweep("--vary", "hub.mass=normal:9:0.5", "--vary", "hinges.sip.P2=uniform:0.01:0.03",
                                "--vary", "hinges[*].P3=10,20", "-n", n, "--sample", sample, *POINTING, out=sample)
            mass, damping = self.numbers(folder, "hub.mass"), self.numbers(folder, "hinges.sip.P2")
            self.assertLess(abs(mass.mean() - 9), 5 * 0.5 / np.sqrt(n))
            self.assertLess(abs(mass.std() / 0.5 - 1), 5 / np.sqrt(2 * n))
            self.assertLess(abs(damping.mean() - 0.02), 5 * 0.02 / np.sqrt(12 * n))
            self.assertTrue((damping >= 0.01).all() and (damping <= 0.03).all())
            self.assertLess(abs((self.numbers(folder, "hinges[*].P3") == 10).mean() - 0.5), 5 * 0.5 / np.sqrt(n))
            if exact:  # far better than chance
                self.assertLess(abs(damping.mean() - 0.02), 0.1 * 0.02 / np.sqrt(12 * n))

    def test_seed_changes_the_draws_and_nothing_else_does(self):
        draw = ("--vary", "hub.mass=normal:9:0.5", "-n", "5", *POINTING)
        one, same, other = (self.numbers(self.sweep(*draw, "--seed", seed, out=out), "hub.mass")
                            for seed, out in (("3", "a"), ("3", "b"), ("4", "c")))
        np.testing.assert_array_equal(one, same)
        self.assertTrue((one != other).all())

    def test_one_factor_multiplies_what_each_key_has(self):
        """The same scene with the products written into it gives the same numbers."""
        varied = self.sweep("--vary", "hinges.sip.P1,hinges.slp.P1*=0.9", "--vary", "hub.inertia*=1.5", *POINTING)
        text = (cli.MESHES / "sport.toml").read_text()
        head, *hinges = text.split("[[hinges]]")
        for i, hinge in enumerate(hinges):
            if 'body = "sip"' in hinge or 'body = "slp"' in hinge:
                value = float(hinge.split("P1 = ")[1].split()[0])
                hinges[i] = hinge.replace(f"P1 = {hinge.split('P1 = ')[1].split()[0]}", f"P1 = {value * 0.9!r}")
        scene = self.folder / "scaled.toml"
        scene.write_text("[[hinges]]".join([head, *hinges]))
        result = flexboom("sweep", scene, *SHORT, "--vary", "hub.inertia*=1.5", *POINTING, "--out", self.folder / "b")
        self.assert_exit(OK, result)
        np.testing.assert_array_equal(self.numbers(varied, "hub.rotation:max"),
                                      self.numbers(self.folder / "b", "hub.rotation:max"))

    def test_words_and_whole_numbers(self):
        folder = self.sweep("--vary", "bodies.sip.structure=beam,eq14", "--vary", "bodies.sip.modes=1,2,3",
                            "--quantity", "sip.q3:max", "--quantity", "sip.tip:max")
        table = self.table(folder)
        self.assertEqual(table["bodies.sip.structure"], ["beam"] * 3 + ["eq14"] * 3)
        self.assertEqual([bool(v) for v in table["sip.q3:max"]], [False, False, True] * 2)  # empty, never 0
        self.assertTrue(all(float(v) > 0 for v in table["sip.tip:max"]))

    def test_a_run_is_that_of_flexboom_run(self):
        folder = self.sweep("--vary", "hub.mass=8.5", "--quantity", "sip.angle:final", "--trajectories")
        run = self.run_sport("--duration", "0.05", "--tolerance", "1e-3", out="run")
        columns = cli.columns(run / "trajectory.csv")
        self.assertEqual(self.numbers(folder, "sip.angle:final")[0], columns["sip.angle"][-1])
        with h5py.File(folder / "sweep.h5") as file:
            names = [name.decode() for name in file["run_000000/columns"][()]]
            trajectory = file["run_000000/trajectory"][()]
        self.assertEqual(names, list(columns))
        np.testing.assert_array_equal(trajectory, np.array(list(columns.values())).T)


    def test_bodies_stiffened_by_the_motion_of_the_scene(self):
        text = (cli.MESHES / "wire-spinner.toml").read_text()
        scene = self.folder / "wires.toml"
        scene.write_text(text.replace("modes = 8", 'modes = 2\nbasis = "prestressed"'))
        result = flexboom("sweep", scene, "--vary", "duration=0.1,0.2", "--out", self.folder / "wires")
        self.assert_exit(OK, result)
        self.assertEqual(self.table(self.folder / "wires")["status"], ["ok", "ok"])

    def test_a_plan_of_the_scene_is_that_of_its_runs(self):
        text = (cli.MESHES / "wire-spinner.toml").read_text().replace("duration = 60.0", "duration = 2.0")
        keys = {"east": "", "north": 'basis = "mean-axis"', "west": 'basis = "prestressed"', "south": 'basis = "clamped"'}
        for name, basis in keys.items():
            text = text.replace(f'name = "{name}"\nmodes = 8', f'name = "{name}"\nmodes = "auto"\n{basis}')
        scene = self.folder / "planned.toml"
        scene.write_text(text.replace("tolerance = 1e-6", "tolerance = 1e-2"))
        result = flexboom("sweep", scene, "--vary", "bodies.hub.mass=250,251",
                          "--quantity", "east.tip.y:final", "--quantity", "north.angle1:final", "--out", self.folder / "planned")
        self.assert_exit(OK, result)
        self.assert_exit(OK, flexboom("run", scene, "--out", self.folder / "run"))
        columns = cli.columns(self.folder / "run" / "trajectory.csv")
        for name in ("east.tip.y", "north.angle1"):
            self.assertEqual(self.numbers(self.folder / "planned", name + ":final")[0], columns[name][-1])


class Journal(Case):
    DRAW = ("--vary", "hub.mass=normal:9:0.5", "--vary", "hinges.sip.P2=uniform:0.01:0.03", "-n", "400", *POINTING)

    def start(self, *arguments):
        process = subprocess.Popen([cli.PROGRAM, "sweep", "sport", *map(str, arguments)], stdin=subprocess.DEVNULL,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(lambda: (process.kill(), process.wait()))
        return process

    def done(self, folder):
        try:
            with sqlite3.connect(f"file:{folder}/sweep.sqlite?mode=ro", uri=True) as journal:
                return journal.execute("SELECT count(*) FROM runs").fetchone()[0]
        except sqlite3.OperationalError:
            return 0

    def stop_after(self, runs, how, *arguments):
        folder = self.folder / "out"
        process = self.start(*SHORT, *self.DRAW, "--out", folder, *arguments)
        end = time.monotonic() + 30
        while self.done(folder) < runs and process.poll() is None and time.monotonic() < end:
            time.sleep(0.005)
        process.send_signal(how)
        return process.wait()

    def workers_of(self, program_arguments):
        found = []
        for entry in os.listdir("/proc"):
            try:
                with open(f"/proc/{entry}/cmdline", "rb") as file:
                    if entry.isdigit() and program_arguments in file.read().decode(errors="replace"):
                        found.append(entry)
            except OSError:
                pass
        return found

    def test_three_kills_lose_and_double_nothing(self):
        folder = self.folder / "out"
        for runs, resume in ((20, ()), (80, ("--resume",)), (150, ("--resume",))):
            self.assertEqual(self.stop_after(runs, signal.SIGKILL, *resume), -signal.SIGKILL)
            end = time.monotonic() + 10
            while self.workers_of(str(folder)) and time.monotonic() < end:
                time.sleep(0.01)
            self.assertEqual(self.workers_of(str(folder)), [])
            self.assertLess(runs - 1, self.done(folder))
        self.sweep(*self.DRAW, "--resume")
        whole = self.sweep(*self.DRAW, out="whole")
        self.assertEqual(self.bytes(folder), self.bytes(whole))
        self.assertEqual(self.table(folder)["run"], [str(i) for i in range(400)])

    def test_interrupt_keeps_the_journal(self):
        self.assertEqual(self.stop_after(30, signal.SIGINT), INTERRUPTED)
        folder = self.folder / "out"
        self.assertEqual(self.summary(folder)["status"], "interrupted")
        before = len(self.table(folder)["run"])
        self.assertGreaterEqual(before, 30)
        self.assertLess(before, 400)
        self.sweep(*self.DRAW, "--resume")
        self.assertEqual(len(self.table(folder)["run"]), 400)
        self.assertEqual(self.summary(folder)["status"], "finished")

    def test_journal_is_not_overwritten_nor_mixed_with_another_sweep(self):
        draw = ["--vary", "hub.mass=normal:9:0.5", "-n", "3", *POINTING]
        folder = self.sweep(*draw)
        before = self.bytes(folder)
        again = flexboom("sweep", "sport", *SHORT, *draw, "--out", folder)
        self.assert_exit(INPUT, again)
        self.assertIn("--resume", again.stderr)
        scene = self.folder / "sport.toml"
        scene.write_text((cli.MESHES / "sport.toml").read_text() + "\n# changed\n")
        for changed, name, word in ((["--vary", "hub.mass=normal:9:0.6", *draw[2:]], "sport", "vary"),
                                    ([*draw[:3], "4", *POINTING], "sport", " n "), (draw + ["--seed", "2"], "sport", "seed"),
                                    (draw + ["--sample", "lhs"], "sport", "sample"), (draw, scene, "scene_sha256"),
                                    (draw + ["--shard", "1/2"], "sport", "shard")):
            result = flexboom("sweep", name, *SHORT, *changed, "--out", folder, "--resume")
            self.assert_exit(INPUT, result)
            self.assertIn(word, result.stderr)
        self.sweep(*draw, "--resume")
        self.assertEqual(self.bytes(folder), before)


    def changed(self, folder, how):
        """A copy of the folder whose journal was changed behind the program's back."""
        copy = shutil.copytree(folder, self.folder / "changed", dirs_exist_ok=True)
        with contextlib.closing(sqlite3.connect(copy / "sweep.sqlite")) as journal:
            self.assertGreater(journal.execute(how).rowcount, 0, how)
            journal.commit()
        return copy

    def test_a_journal_that_was_changed_is_refused(self):
        draw = ["--vary", "hub.mass=normal:9:0.5", "-n", "3", "--trajectories", *POINTING]
        folder = self.sweep(*draw)
        facts = lambda old, new: f"UPDATE sweep SET facts = replace(facts, '{old}', '{new}') WHERE facts LIKE '%{old}%'"
        for how, words in (
                (facts('"seed":1', '"seed":2'), "the checksum differs"),
                (facts("normal:9", "normal:8"), "the checksum differs"),
                (facts("flexboom-sweep-2", "flexboom-sweep-3"),
                 'its format is "flexboom-sweep-3"; this version reads "flexboom-sweep-2"'),
                ("UPDATE sweep SET facts = 'none'", "is no journal"),
                ("DELETE FROM sweep", "is empty"),
                ("UPDATE runs SET q1 = q1 * 1.000000001 WHERE run = 1", "run 1 was changed"),
                ("UPDATE runs SET q1 = NULL WHERE run = 1", "run 1 was changed"),
                ("UPDATE runs SET status = 'input' WHERE run = 2", "run 2 was changed"),
                ("UPDATE runs SET message = 'mine' WHERE run = 0", "run 0 was changed"),
                ("UPDATE trajectories SET by_columns = zeroblob(length(by_columns)) WHERE run = 2",
                 "the trajectory of run 2 was changed")):
            bad = self.changed(folder, how)
            for command in (["sport", *SHORT, *draw, "--resume", "--out", bad],
                            ["--merge", bad, "--out", self.folder / "merged"]):
                result = flexboom("sweep", *command)
                self.assert_exit(INPUT, result)
                self.assertIn(words, result.stderr, how)
                shutil.rmtree(self.folder / "merged", ignore_errors=True)

    def test_only_files_are_read(self):
        for device in (os.mkfifo, lambda path: os.symlink("/dev/zero", path)):
            folder = self.folder / "out"
            folder.mkdir()
            device(folder / "sweep.sqlite")
            result = flexboom("sweep", "sport", *SHORT, "--vary", "hub.mass=8", "--resume", "--out", folder, timeout=20)
            self.assert_exit(INPUT, result)
            self.assertIn("sweep.sqlite: it is a device, pipe or socket, not a file", result.stderr)
            shutil.rmtree(folder)


class Shards(Case):
    DRAW = ("--vary", "hub.mass=normal:9:0.5", "--vary", "hinges.sip.P2=uniform:0.01:0.03", "-n", "21", "--sample",
            "lhs", "--trajectories", *POINTING)

    def test_shards_are_one_sweep_bit_for_bit(self):
        whole = self.sweep(*self.DRAW, "--jobs", "1", out="whole")
        shards = [self.sweep(*self.DRAW, "--shard", f"{i}/4", "--jobs", "2", out=f"shard{i}") for i in (1, 2, 3, 4)]
        self.assertEqual(self.table(shards[1])["run"], ["1", "5", "9", "13", "17"])
        merged = self.folder / "merged"
        self.assert_exit(OK, flexboom("sweep", "--merge", *reversed(shards), "--out", merged))
        self.assertEqual(self.bytes(merged), self.bytes(whole))
        self.assertEqual((merged / "sweep.h5").read_bytes(), (whole / "sweep.h5").read_bytes())

        for folders, words in ((shards[:3], ("missing", "3, 7, 11, 15, 19")),
                               (shards + shards[:1], ("more than once", "0, 4, 8, 12, 16, 20")),
                               ([self.folder / "nowhere"], ("no such file",))):
            result = flexboom("sweep", "--merge", *folders, "--out", self.folder / "other")
            self.assert_exit(INPUT, result)
            for word in words:
                self.assertIn(word, result.stderr)
        other = self.sweep("--vary", "hub.mass=8", *POINTING, out="another")
        result = flexboom("sweep", "--merge", *shards, other, "--out", self.folder / "other")
        self.assert_exit(INPUT, result)
        self.assertIn("different sweeps", result.stderr)

    def test_number_of_jobs_changes_nothing(self):
        draw = ("--vary", "bodies.sip.segments[0].length=uniform:0.25:0.35", "--vary", "hub.mass=8,9", "-n", "30")
        one, two = (self.sweep(*draw, "--jobs", jobs, out=jobs) for jobs in ("1", "2"))
        self.assertEqual(self.bytes(one), self.bytes(two))


class Failures(Case):
    def test_a_failing_run_is_a_row(self):
        folder = self.sweep("--vary", "hub.mass=8,-1,9", *POINTING, code=NUMERICAL)
        table = self.table(folder)
        self.assertEqual(table["status"], ["ok", "input", "ok"])
        self.assertEqual(table["hub.rotation:max"][1], "")
        self.assertIn("must be positive", table["message"][1])
        self.assertEqual(table["message"][0], "")
        summary = self.summary(folder)
        self.assertEqual(summary["runs"], {"planned": 3, "done": 3, "failed": 1})
        self.assertEqual(summary["quantities"]["hub.rotation:max"]["count"], 2)
        again = flexboom("sweep", "sport", *SHORT, "--vary", "hub.mass=8,-1,9", *POINTING, "--out", folder, "--resume")
        self.assert_exit(NUMERICAL, again)  # not tried again
        self.assertIn("1 of 3 runs failed", again.stderr)

    def test_a_worker_that_is_killed_costs_its_run_alone(self):
        folder = self.folder / "out"
        process = subprocess.Popen([cli.PROGRAM, "sweep", "sport", "--vary", "hub.mass=lin:8:9:40", *POINTING, "--jobs",
                                    "1", "--out", folder], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True)
        self.addCleanup(lambda: (process.kill(), process.wait()))
        children = f"/proc/{process.pid}/task/{process.pid}/children"
        end = time.monotonic() + 20
        worker = None
        while worker is None and time.monotonic() < end:
            with open(children) as file:
                worker = next(map(int, file.read().split()), None)
        os.kill(worker, signal.SIGKILL)
        self.assertIn("1 of 40 runs failed", process.communicate(timeout=60)[1])
        self.assertEqual(process.returncode, NUMERICAL)
        table = self.table(folder)
        self.assertEqual(table["run"], [str(i) for i in range(40)])
        self.assertEqual(sorted(set(table["status"])), ["crashed", "ok"])
        self.assertIn("signal 9", "".join(table["message"]))

    def test_no_value_is_null(self):
        folder = self.sweep("--vary", "hub.mass=8,-1", "--shard", "2/2", *POINTING, code=NUMERICAL)
        q = self.summary(folder)["quantities"]["hub.rotation:max"]
        self.assertEqual((q["count"], q["mean"], q["quantiles"]["0.5"]), (0, None, None))


class Results(Case):
    def test_files_and_report(self):
        folder = self.sweep("--vary", "hub.mass=uniform:8:9", "--vary", "hinges.sip.P2=uniform:0.005:0.02", "-n", "16",
                            "--sample", "sobol", "--indices", *POINTING, "--quantity", "settle:sip.angle:0.1", "--report")
        self.assertEqual({"sweep.sqlite", "sweep.csv", "sweep.h5", "summary.json", "report.html"},
                         set(os.listdir(folder)))
        table = self.table(folder)
        self.assertEqual(len(table["run"]), 16 * 4)
        with h5py.File(folder / "sweep.h5") as file:
            np.testing.assert_array_equal(file["varied/hub.mass"][()], self.numbers(folder, "hub.mass"))
            np.testing.assert_array_equal(file["quantities/hub.rotation:max"][()],
                                          self.numbers(folder, "hub.rotation:max"))
            self.assertEqual(set(file["status"][()]), {b"ok"})
        q = self.summary(folder)["quantities"]["hub.rotation:max"]
        values = self.numbers(folder, "hub.rotation:max")
        for share, value in q["quantiles"].items():
            self.assertAlmostEqual(value, np.quantile(values, float(share)), delta=1e-15)
        self.assertAlmostEqual(q["mean"], values.mean(), delta=1e-15)
        self.assertEqual(q["indices"]["base_points"], 16)
        self.assertGreater(q["indices"]["total"]["hinges.sip.P2"], 10 * q["indices"]["total"]["hub.mass"])
        page = (folder / "report.html").read_text()
        drawings = page.split("<svg")[1:]
        self.assertGreaterEqual(len(drawings), 2)
        for drawing in drawings:
            ElementTree.fromstring("<svg" + drawing[:drawing.index("</svg>")] + "</svg>")
            self.assertNotIn("nan", drawing)
        self.assertIn("Sobol indices", page)

    def test_pointing_is_that_of_a_run_with_many_digits(self):
        """Steps at the tolerance alone make a pointing error that is a hundred times the true one."""
        duration = 160
        self.assert_exit(OK, flexboom("sweep", "sport-calibration", "--vary", "accuracy.tolerance=1e-3", "--vary",
                                      f"duration={duration}", "--quantity", "sport.pointing:max", "--out",
                                      self.folder / "o"))
        out = self.folder / "run"
        self.assert_exit(OK, flexboom("run", "sport-calibration", "--no-budget", "--quiet", "--tolerance", "1e-8",
                                      "--duration", str(duration), "--out", out))
        columns = cli.columns(out / "trajectory.csv")
        exact = max(np.linalg.norm([columns[f"sport.pointing.{axis}"] for axis in "xyz"], axis=0))
        self.assertLess(abs(self.numbers(self.folder / "o", "sport.pointing:max")[0] / exact - 1), 1e-2)

    def test_json_is_the_summary(self):
        result = flexboom("sweep", "sport", *SHORT, "--vary", "hub.mass=8", "--loads", "--json", "--out", self.folder / "o")
        self.assert_exit(OK, result)
        document = json.loads(result.stdout)
        self.assertEqual(document, self.summary(self.folder / "o"))
        self.assertIn("sip.torque:max", document["quantities"])
        self.assertIn("hub.rotation.x:rms", document["quantities"])


class SlowAgainstRuns(Case):
    def test_pointing_of_sport_is_that_of_single_runs(self):
        """Spread of the springs and dampers of all hinges: draws of numpy and `flexboom run` against the sweep."""
        n, runs = 4000, 300
        options = ("--vary", "accuracy.tolerance=1e-4", "--vary", "duration=3", "--vary", "hinges[*].P1*=normal:1:0.05",
                   "--vary", "hinges[*].P2*=uniform:0.7:1.3", "-n", n, *POINTING)
        folder = self.folder / "sweep"
        self.assert_exit(OK, flexboom("sweep", "sport", *options, "--out", folder, timeout=2000))
        swept = self.numbers(folder, "hub.rotation:max")
        text = (cli.MESHES / "sport.toml").read_text()
        random = np.random.default_rng(20)

        def pointing(i, spring, damper):
            lines = []
            for line in text.splitlines():
                key, _, value = line.partition(" = ")
                factor = {"P1": spring, "P2": damper}.get(key)
                lines.append(f"{key} = {float(value.split('#')[0]) * factor!r}" if factor else line)
            scene = self.folder / f"scene{i}.toml"
            scene.write_text("\n".join(lines))
            out = self.folder / f"run{i}"
            self.assert_exit(OK, flexboom("run", scene, "--no-budget", "--quiet", "--tolerance", "1e-4", "--duration", "3",
                                          "--out", out))
            columns = cli.columns(out / "trajectory.csv")
            return max(np.linalg.norm([columns[f"hub.rotation.{axis}"] for axis in "xyz"], axis=0))

        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            single = np.array(list(pool.map(pointing, range(runs), random.normal(1, 0.05, runs),
                                            random.uniform(0.7, 1.3, runs))))
        # Four standard deviations of the difference of both means; of the share above the sweep's 99 % quantile.
        deviation = single.std(ddof=1) * np.sqrt(1 / runs + 1 / n)
        self.assertLess(abs(single.mean() - swept.mean()), 4 * deviation)
        self.assertLess(abs(single.std(ddof=1) / swept.std(ddof=1) - 1), 4 / np.sqrt(2 * runs) * 2)
        above = (single > np.quantile(swept, 0.99)).mean()
        self.assertLess(abs(above - 0.01), 4 * np.sqrt(0.01 * 0.99 * (1 / runs + 1 / n)))


if __name__ == "__main__":
    cli.PROGRAM = sys.argv.pop(1)
    unittest.main()
