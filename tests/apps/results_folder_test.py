"""Results folders: one run at a time, nothing of another one, and nothing lost when a run is killed.
Usage: results_folder_test.py PROGRAM [unittest arguments]"""

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest

import numpy as np

import cli_test as cli
from cli_test import INPUT, INTERRUPTED, MESHES, NUMERICAL, OK, flexboom

RESULTS = {"events.csv", "scene.toml", "state.toml", "summary.json", "trajectory.csv"}


class Case(cli.Case):
    def start(self, *arguments, **options):
        process = subprocess.Popen([cli.PROGRAM, *map(str, arguments)], stdin=subprocess.DEVNULL,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **options)
        self.addCleanup(lambda: (process.kill(), process.wait()))
        return process

    def state_time(self, folder):
        try:
            return float(re.search(r"^time = (\S+)", (folder / "state.toml").read_text(), re.M)[1])
        except (FileNotFoundError, TypeError):
            return None

    def wait_for(self, condition, what):
        end = time.monotonic() + 60
        while not condition():
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.01)

    def start_endless(self, after=0.05, **options):
        """A run that has got as far as `after`, with its folder."""
        folder = self.folder / "out"
        process = self.start(*self.endless(), "--checkpoint", "0.05", **options)
        self.wait_for(lambda: (self.state_time(folder) or 0) > after, "no checkpoint")
        return process, folder

    def rows(self, folder):
        return cli.read_csv(folder / "trajectory.csv")


class OneAtATime(Case):
    def test_second_run_is_refused_and_says_who_is_there(self):
        process, folder = self.start_endless()
        for arguments in (("sport",), ("tumbling",), ("sport", "--continue", folder)):
            result = flexboom("run", *arguments, "--duration", "1e4", "--out", folder)
            self.assert_exit(INPUT, result)
            self.assertIn(str(folder), result.stderr)
            self.assertIn(f"process {process.pid}", result.stderr)
        self.assertIsNone(process.poll())
        self.assertEqual(self.summary(folder)["status"], "running")
        self.assertEqual(self.summary(folder)["scene"], "sport")

    def test_a_killed_run_locks_nobody_out(self):
        process, folder = self.start_endless()
        process.kill()
        process.wait()
        self.assertEqual(self.summary(folder)["status"], "running")
        self.run_sport("--duration", "0.1")
        self.assertEqual(set(os.listdir(folder)), RESULTS)

    def test_many_at_once(self):
        out = self.folder / "out"
        runs = [self.start("run", "sport", "--no-budget", "--duration", "0.5", "--out", out) for _ in range(6)]
        codes = [run.wait() for run in runs]
        self.assertIn(OK, codes)
        self.assertEqual(set(codes) - {OK, INPUT}, set())
        self.assertEqual(set(os.listdir(out)), RESULTS)
        self.assertEqual(self.summary(out)["status"], "finished")


class Foreign(Case):
    """Files that are not this run's."""

    def test_scene_of_the_user_stays(self):
        scene = self.folder / "scene.toml"
        shutil.copy(MESHES / "sport.toml", scene)
        text = scene.read_bytes()
        (self.folder / "link").symlink_to(self.folder)
        (self.folder / "mine.toml").symlink_to(scene)
        os.link(scene, self.folder / "hard.toml")
        for name in ("scene.toml", "./scene.toml", "link/scene.toml", "mine.toml", "hard.toml"):
            for out in (".", "link", self.folder):
                result = flexboom("run", name, "--duration", "0.1", "--out", out, cwd=self.folder)
                self.assert_exit(INPUT, result)
                self.assertIn("would be overwritten", result.stderr)
        self.assertEqual(scene.read_bytes(), text)
        self.assertEqual(set(os.listdir(self.folder)), {"scene.toml", "link", "mine.toml", "hard.toml"})

    def test_a_scene_of_another_name_may_lie_there(self):
        scene = self.folder / "mine.toml"
        shutil.copy(MESHES / "sport.toml", scene)
        (self.folder / "notes.txt").write_text("mine")
        self.assert_exit(OK, flexboom("run", "mine.toml", "--no-budget", "--duration", "0.1", "--out", ".",
                                      cwd=self.folder))
        self.assertEqual(scene.read_bytes(), (MESHES / "sport.toml").read_bytes())
        self.assertEqual(set(os.listdir(self.folder)), RESULTS | {"mine.toml", "notes.txt"})

    def test_out_is_a_file(self):
        file = self.folder / "file"
        file.write_text("mine")
        for out in (file, file / "below"):
            self.assert_exit(INPUT, flexboom("run", "sport", "--duration", "0.1", "--out", out))
        self.assertEqual(file.read_text(), "mine")

    def test_nothing_of_an_older_run_stays(self):
        out = self.run_sport("--duration", "0.3", "--report", "--vtu-step", "0.1")
        (out / "trajectory.csv.part").write_text("half")
        self.run_sport("--duration", "0.1")
        self.assertEqual(set(os.listdir(out)), RESULTS)


class Failed(Case):
    def stops_being_a_number(self):
        """Its drive is no number half of the time after half a second, at none of the times that are looked at before a run."""
        scene = self.folder / "nan.toml"
        text = (MESHES / "two-link-arm.toml").read_text()
        scene.write_text(re.sub(r'drive = .*', 'drive = "t + 0*log(cos(160849.543863797*max(t - 0.5, 0)))"', text, count=1))
        return scene

    def test_rows_and_state_are_kept_and_the_folder_says_so(self):
        out = self.run_sport("--duration", "0.3", "--report", "--vtu-step", "0.1")
        for formulation in ("relative", "multipliers"):
            result = flexboom("run", self.stops_being_a_number(), "--no-budget", "--duration", "1", "--report",
                              "--formulation", formulation, "--out", out)
            self.assert_exit(NUMERICAL, result)
            summary, rows = self.summary(out), self.rows(out)
            self.assertEqual((summary["scene"], summary["status"]), ("two-link-arm", "failed"))
            self.assertIs(summary["interrupted"], False)
            self.assertIn(summary["error"], result.stderr)
            self.assertGreater(len(rows), 20)
            self.assertLess(float(rows[-1][0]), 0.52)
            self.assertGreater(float(rows[-1][0]), 0.4)
            self.assertGreater(self.state_time(out), 0.4)
            self.assertLess(self.state_time(out), 0.52)
            self.assertIn("This run failed", (out / "report.html").read_text())
            self.assertEqual({f for f in os.listdir(out) if f.startswith("motion")}, set())

    def test_a_motion_that_loses_its_balance_is_wrong_and_the_folder_says_so(self):
        """A stiff boom that rings undamped, by a method that damps what it does not follow."""
        scene = cli.TESTS / "verification" / "stiffened" / "ringing_boom.toml"
        out = self.folder / "out"
        result = flexboom("run", scene, "--formulation", "multipliers", "--tolerance", "0.1", "--duration", "0.2",
                          "--no-budget", "--report", "--out", out)
        self.assert_exit(NUMERICAL, result)
        self.assertIn(f"the motion in {out}, or its energies, are wrong", result.stderr)
        summary, rows = self.summary(out), self.rows(out)
        self.assertEqual(summary["status"], "failed")
        self.assertIn(summary["error"], result.stderr)
        self.assertGreater(summary["energy_balance"], 0.01)
        self.assertEqual((len(rows), float(rows[-1][0])), (22, 0.2))
        self.assertEqual(self.state_time(out), 0.2)

    def test_a_run_that_is_refused_late_leaves_the_folder_as_it_was(self):
        """Its state is that of another scene, which shows when the bodies are made."""
        out = self.run_sport("--duration", "0.3", "--report", "--vtu-step", "0.1")
        other = self.folder / "other"
        self.assert_exit(OK, flexboom("run", "two-link-arm", "--no-budget", "--duration", "0.1", "--out", other))
        files = {f: (out / f).read_bytes() for f in os.listdir(out)}
        result = flexboom("run", "sport", "--no-budget", "--continue", other, "--out", out)
        self.assert_exit(INPUT, result)
        self.assertIn("is of another scene", result.stderr)
        self.assertEqual({f: (out / f).read_bytes() for f in os.listdir(out)}, files)
        empty = self.folder / "empty"  # where nothing was, the folder says what came of the run
        self.assert_exit(INPUT, flexboom("run", "sport", "--no-budget", "--continue", other, "--out", empty))
        self.assertEqual(self.summary(empty)["status"], "failed")

    def test_a_full_disk_is_an_error_and_the_folder_says_so(self):
        out = self.folder / "out"
        result = subprocess.run(
            ["bash", "-c", f"ulimit -f 40; exec '{cli.PROGRAM}' run sport --no-budget --duration 2 --out '{out}'"],
            capture_output=True, text=True)
        self.assertEqual(result.returncode, INPUT, result.stderr)
        self.assertIn("trajectory.csv: File too large", result.stderr)
        self.assertEqual(self.summary(out)["status"], "failed")
        self.assertIn("File too large", self.summary(out)["error"])


class HungUp(Case):
    check_folder = cli.Interrupted.check_folder

    def test_hang_up(self):
        process, _ = self.start_endless()
        process.send_signal(signal.SIGHUP)
        self.assertEqual(process.wait(), INTERRUPTED)
        self.check_folder()
        self.assertEqual(self.summary(self.folder / "out")["status"], "interrupted")

    def test_nohup_is_respected(self):
        ignore = lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)
        process, folder = self.start_endless(preexec_fn=ignore)
        process.send_signal(signal.SIGHUP)
        seen = self.state_time(folder)
        self.wait_for(lambda: self.state_time(folder) > seen, "it has ended")
        process.terminate()
        self.assertEqual(process.wait(), INTERRUPTED)


class Kills(Case):
    def errors(self, a, b):
        """By output: the largest difference of its columns over its largest value; of an energy, over the largest."""
        self.assertEqual(list(a), list(b))
        np.testing.assert_allclose(b["t"], a["t"], rtol=1e-12)
        outputs, energies = {}, [n for n in a if n.startswith("energy.")]
        for name in a:
            outputs.setdefault(re.sub(r"\.[xyz]$|(?<=q)\d+$", "", name), []).append(name)
        r = {}
        for output, names in outputs.items():
            size = max(np.abs(a[n]).max() for n in (energies if names[0] in energies else names))
            if size > 1e-15:
                r[output] = max(np.abs(a[n] - b[n]).max() for n in names) / size
        return r

    def fly_through_kills(self, kills, *arguments):
        """Kills the run at `kills` random times of its motion; returns how often it went on."""
        out, went_on = self.folder / "killed", 0
        end = float(arguments[arguments.index("--duration") + 1])
        go_on = lambda: ["--continue", out] if (out / "summary.json").exists() else []
        for target in sorted(random.uniform(0, end) for _ in range(kills)):
            process = self.start("run", *arguments, "--no-budget", "--quiet", "--out", out, *go_on())
            while process.poll() is None and (self.state_time(out) or 0) <= target:
                time.sleep(0.002)
            process.send_signal(signal.SIGKILL)
            if process.wait() == OK or self.state_time(out) == end:  # it was too late
                return went_on
            went_on += (self.state_time(out) or 0) > 0
        self.assert_exit(OK, flexboom("run", *arguments, "--no-budget", "--quiet", "--out", out, *go_on(), timeout=600))
        return went_on

    def check_killed(self, kills, *arguments, tolerance, checkpoint):
        """Each start anew puts the motion no further from the run in one than that is from itself at a tenth of the
        tolerance."""
        random.seed(repr(arguments))
        whole, tight = self.folder / "whole", self.folder / "tight"
        watched = (*arguments, "--tolerance", tolerance, "--checkpoint", checkpoint)
        self.assert_exit(OK, flexboom("run", *watched, "--no-budget", "--quiet", "--out", whole, timeout=600))
        self.assert_exit(OK, flexboom("run", *arguments, "--tolerance", tolerance / 10, "--no-budget", "--quiet", "--out",
                                      tight, timeout=600))
        went_on = self.fly_through_kills(kills, *watched)
        killed = self.folder / "killed"
        self.assertEqual(self.summary(killed)["status"], "finished")
        a, b, c = (cli.columns(f / "trajectory.csv") for f in (whole, killed, tight))
        own = self.errors(c, a)
        for output, error in self.errors(a, b).items():
            self.assertLess(error, (3 + went_on) * own[output] + 10 * tolerance, output)
        events = [cli.read_csv(f / "events.csv") for f in (whole, killed)]
        self.assertEqual([e[1:] for e in events[1]], [e[1:] for e in events[0]])
        return went_on


class Killed(Kills):
    """A run that is killed again and again and goes on each time is one run."""

    def test_sport(self):
        self.assertGreater(self.check_killed(6, "sport", "--duration", "2", tolerance=1e-7, checkpoint="0"), 0)

    def test_a_run_whose_errors_are_measured_is_whole(self):
        out = self.folder / "out"
        process = self.start("run", "sport", "--formulation", "multipliers", "--duration", "0.5", "--tolerance", "1e-3", "--quiet",
                             "--out", out)
        while process.poll() is None and self.state_time(out) != 0.5:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        self.assertEqual(process.wait(), -signal.SIGKILL, "its errors took no time")
        summary = self.summary(out)
        self.assertEqual((summary["status"], summary["error_budget"]["total"]), ("running", None))
        self.assertEqual(cli.columns(out / "trajectory.csv")["t"][-1], 0.5)
        self.assertTrue(cli.read_csv(out / "events.csv")[1:])

    def test_other_methods_and_scenes(self):
        for arguments in (("sport", "--duration", "0.3", "--integrator", "bdf"),
                          ("sport", "--duration", "0.05", "--formulation", "multipliers"),
                          ("flexible-appendage", "--duration", "2"),
                          ("slider-crank", "--duration", "0.02")):
            with self.subTest(arguments):
                self.check_killed(3, *arguments, tolerance=1e-6, checkpoint="0.02")
            for name in ("whole", "tight", "killed"):
                shutil.rmtree(self.folder / name, ignore_errors=True)

    def test_every_frame_is_there(self):
        self.check_killed(3, "sport", "--duration", "1", "--vtu-step", "0.1", tolerance=1e-6, checkpoint="0")
        lists = [(self.folder / name / "motion.pvd").read_text() for name in ("whole", "killed")]
        self.assertEqual(lists[0], lists[1])
        frames = re.findall(r'file="(.*?)"', lists[0])
        self.assertEqual(len(frames), 11)
        self.assertLessEqual(set(frames), set(os.listdir(self.folder / "killed")))

    def test_an_event_at_the_time_of_the_state(self):
        """Which the killed run had written and had not gone past: it is seen again, and is there once."""
        run = lambda *arguments: self.assert_exit(OK, flexboom("run", "sport-calibration", "--no-budget", *arguments))
        whole, out = self.folder / "whole", self.folder / "out"
        run("--duration", "14", "--out", whole)
        run("--duration", "10", "--out", out)
        events = cli.read_csv(whole / "events.csv")
        self.assertEqual(float(events[1][0]), 10)
        with open(out / "events.csv", "a") as file:
            file.write(",".join(events[1]) + "\n")
        run("--duration", "14", "--continue", out, "--out", out)
        self.assertEqual([e[1:] for e in cli.read_csv(out / "events.csv")], [e[1:] for e in events])

    def test_what_happens_as_a_run_begins(self):
        """The hinge slips at 0 s, of which the first state is: it slips again when that goes on, and is listed once."""
        arguments = ["run", "latching-panel", "--no-budget", "--tolerance", "1e-9", "--duration", "5", "--out"]
        whole, out = self.folder / "whole", self.folder / "out"
        self.assert_exit(OK, flexboom(*arguments, whole))
        process = self.start(*arguments, out)
        self.wait_for(lambda: self.state_time(out) is not None, "no state")
        process.kill()
        process.wait()
        self.assert_exit(OK, flexboom(*arguments, out, "--continue", out))
        events = [[e[1:] for e in cli.read_csv(folder / "events.csv")] for folder in (whole, out)]
        self.assertEqual(events[0][1], ["hinge", "slip"])
        self.assertEqual(events[1], events[0])

    def test_a_last_line_that_is_cut_off(self):
        process, folder = self.start_endless(after=0.2)
        process.kill()
        process.wait()
        with open(folder / "trajectory.csv", "a") as file:
            file.write("0.99,1.0,2.")
        with open(folder / "events.csv", "a") as file:
            file.write("0.9")
        self.assert_exit(OK, flexboom("report", folder))
        self.assertIn("was killed", (folder / "report.html").read_text())
        end = self.state_time(folder) + 0.1
        arguments = self.endless()[1:-4]
        self.assert_exit(OK, flexboom("run", *arguments, "--duration", end, "--continue", folder, "--out", folder))
        t = cli.columns(folder / "trajectory.csv")["t"]
        np.testing.assert_allclose(t[:-1], 0.01 * np.arange(len(t) - 1), rtol=1e-12)
        self.assertEqual(t[-1], end)

    def test_before_its_first_state(self):
        folder = self.run_sport("--duration", "0.1")
        (folder / "state.toml").unlink()
        self.assert_exit(INPUT, flexboom("run", "sport", "--duration", "0.2", "--continue", folder, "--out", folder))
        text = (folder / "summary.json").read_text()
        (folder / "summary.json").write_text(text.replace('"finished"', '"running"'))
        result = flexboom("run", "sport", "--duration", "0.2", "--no-budget", "--continue", folder, "--out", folder)
        self.assert_exit(OK, result)
        self.assertIn("begins at 0 s", result.stderr)
        self.assertEqual(len(self.rows(folder)), 22)


class InPlace(Case):
    def test_goes_on_in_its_own_folder(self):
        whole = self.run_sport("--duration", "0.4", "--vtu-step", "0.05", out="whole")
        out = self.run_sport("--duration", "0.2137", "--vtu-step", "0.05")
        self.run_sport("--duration", "0.4", "--vtu-step", "0.05", "--continue", out)
        a, b = (cli.columns(f / "trajectory.csv") for f in (whole, out))
        np.testing.assert_array_equal(b["t"], a["t"])
        np.testing.assert_allclose(b["sip.angle"], a["sip.angle"], rtol=1e-5)
        self.assertEqual((out / "motion.pvd").read_text(), (whole / "motion.pvd").read_text())
        self.assertEqual(len(cli.read_csv(out / "events.csv")), len(cli.read_csv(whole / "events.csv")))

    def test_from_its_own_scene_file(self):
        out = self.run_sport("--duration", "0.2")
        self.assert_exit(OK, flexboom("run", out / "scene.toml", "--duration", "0.4", "--continue", out, "--out", out))
        self.assertEqual(len(self.rows(out)), 42)

    def test_only_files_are_read(self):
        """A pipe that nobody writes to would be waited for, a line of /dev/zero never ends."""
        good = self.run_sport("--duration", "0.2", "--vtu-step", "0.1")
        for name in ("summary.json", "trajectory.csv", "events.csv", "motion.pvd"):
            for device in (os.mkfifo, lambda path: os.symlink("/dev/zero", path)):
                bad = self.folder / "bad"
                shutil.copytree(good, bad)
                (bad / name).unlink()
                device(bad / name)
                if name == "summary.json":  # read where there is no state
                    (bad / "state.toml").unlink()
                result = flexboom("run", "sport", "--no-budget", "--duration", "0.3", "--vtu-step", "0.1",
                                  "--continue", bad, "--out", bad, timeout=20)
                self.assert_exit(INPUT, result)
                self.assertIn(f"{bad / name}: it is a device, pipe or socket, not a file", result.stderr)
                shutil.rmtree(bad)

    def test_a_missing_table_is_named(self):
        for name in ("trajectory.csv", "events.csv"):
            out = self.run_sport("--duration", "0.2")
            (out / name).unlink()
            result = flexboom("run", "sport", "--duration", "0.3", "--continue", out, "--out", out)
            self.assert_exit(INPUT, result)
            self.assertIn(f"{out / name} is missing", result.stderr)

    def test_other_columns_are_refused_and_nothing_is_lost(self):
        out = self.run_sport("--duration", "0.2")
        text = (out / "trajectory.csv").read_text()
        (out / "trajectory.csv").write_text(text.replace("sip.angle", "sip.ankle", 1))
        before = {f: (out / f).read_bytes() for f in os.listdir(out)}
        result = flexboom("run", "sport", "--duration", "0.4", "--continue", out, "--out", out)
        self.assert_exit(INPUT, result)
        self.assertIn("other columns", result.stderr)
        result = flexboom("run", "tumbling", "--continue", out, "--out", out)
        self.assert_exit(INPUT, result)
        self.assertEqual({f: (out / f).read_bytes() for f in os.listdir(out)}, before)

    def test_a_state_goes_on_in_the_same_bodies_and_joints(self):
        out, scene = self.folder / "out", self.folder / "changed.toml"
        slew = (cli.MESHES / "panel-slew.toml").read_text()
        run = lambda text, *more: scene.write_text(text) and flexboom("run", scene, "--no-budget", *more)
        self.assert_exit(OK, run(slew, "--duration", "0.2", "--out", out))
        go_on = ("--duration", "0.3", "--continue", out, "--out", self.folder / "later")
        self.assertNotIn("another one", run(slew, *go_on).stderr)
        thicker = re.sub(r"height = [0-9.]+", "height = 0.03", slew)
        self.assertNotEqual(thicker, slew)
        result = run(thicker, *go_on)
        self.assert_exit(OK, result)
        self.assertIn("is another one in", result.stderr)
        slider = re.sub(r'kind = "hinge"', 'kind = "slider"', slew)
        self.assertNotEqual(slider, slew)
        result = run(slider, *go_on)
        self.assert_exit(INPUT, result)
        self.assertIn("and a slider here", result.stderr)


class Changed(Case):
    """States that were changed by hand."""

    def test_refused_unless_forced(self):
        out = self.run_sport("--duration", "0.2")
        good = (out / "state.toml").read_text()
        go_on = ("run", "sport", "--no-budget", "--duration", "0.3", "--continue", out, "--out", self.folder / "later")
        changes = {
            "a number": good.replace("0.2 ", "0.21 ", 1), "a comment": good + "# mine\n", "a space": good + "\n",
            "the checksum": re.sub(r'(sha256 = ")(.)', lambda m: m[1] + ("1" if m[2] == "0" else "0"), good),
            "no checksum": re.sub(r"sha256.*\n", "", good), "line ends": good.replace("\n", "\r\n")}
        for what, text in changes.items():
            self.assertNotEqual(text, good, what)
            (out / "state.toml").write_bytes(text.encode())
            result = flexboom(*go_on)
            self.assert_exit(INPUT, result)
            self.assertIn("state.toml:", result.stderr, what)
            self.assertIn("--force", result.stderr, what)
            self.assert_exit(OK, flexboom(*go_on, "--force"))
        (out / "state.toml").write_text(good)
        self.assert_exit(OK, flexboom(*go_on))

    def test_version_of_the_format(self):
        out = self.run_sport("--duration", "0.2")
        good = (out / "state.toml").read_text()
        for version in ("1", "3", "4", "two"):
            (out / "state.toml").write_text(re.sub('"flexboom-state-.*?"', f'"flexboom-state-{version}"', good))
            result = flexboom("run", "sport", "--duration", "0.3", "--continue", out, "--out", self.folder / "later",
                              "--force")
            self.assert_exit(INPUT, result)
            self.assertIn(f'is "flexboom-state-{version}"; this version reads "flexboom-state-7"', result.stderr)


class SlowKilled(Kills):
    def test_sixty_seconds_killed_ten_times(self):
        self.assertGreater(
            self.check_killed(10, "sport-calibration", "--duration", "60", "--integrator", "bdf", tolerance=1e-6, checkpoint="0.1"), 0)


if __name__ == "__main__":
    if len(sys.argv) > 1 and not sys.argv[1].startswith("-"):
        cli.PROGRAM = sys.argv.pop(1)
    unittest.main(argv=[sys.argv[0], *sys.argv[1:]])
