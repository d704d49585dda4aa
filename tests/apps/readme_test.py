#!/usr/bin/env python3
"""Runs README.md's `flexboom` commands, in their order, in a folder that holds nothing but the repository's meshes.
Holds the errors that the worked example of meshes/README.md tells against those of a run.

The argument is the program. Lines of `flexboom bench` are left out: they measure speed for minutes and need an idle machine.
"""
import json
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
# What the README takes for the reader's own files: a cantilever of two bricks, and a scene.
DECK = """*NODE, NSET=ALL
1, 0, 0, 0
2, 0, 0.01, 0
3, 0, 0.01, 0.01
4, 0, 0, 0.01
5, 0.1, 0, 0
6, 0.1, 0.01, 0
7, 0.1, 0.01, 0.01
8, 0.1, 0, 0.01
9, 0.2, 0, 0
10, 0.2, 0.01, 0
11, 0.2, 0.01, 0.01
12, 0.2, 0, 0.01
*ELEMENT, TYPE=C3D8I, ELSET=BEAM
1, 1, 5, 6, 2, 4, 8, 7, 3
2, 5, 9, 10, 6, 8, 12, 11, 7
*MATERIAL, NAME=ALUMINIUM
*ELASTIC
67e9, 0.33
*DENSITY
2840
*SOLID SECTION, ELSET=BEAM, MATERIAL=ALUMINIUM
*BOUNDARY
1, 1, 3
2, 1, 3
3, 1, 3
4, 1, 3
*STEP
*FREQUENCY
4
*END STEP
"""


def commands():
    """Arguments of every `flexboom` line in a block of shell commands, without comments."""
    blocks = re.findall(r"^```sh\n(.*?)^```", (ROOT / "README.md").read_text(), re.S | re.M)
    lines = [shlex.split(line, comments=True) for block in blocks for line in block.splitlines()]
    return [line[1:] for line in lines if line and line[0] == "flexboom"]


def run(program, folder, arguments):
    """Whether the command succeeds; prints how it went."""
    start = time.monotonic()
    result = subprocess.run([program, *arguments], cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    print(f"exit {result.returncode}, {time.monotonic() - start:5.1f} s: flexboom {shlex.join(arguments)}", flush=True)
    if result.returncode != 0:
        print(result.stdout + result.stderr)
    return result.returncode == 0


def worked_example(program, folder):
    """Whether wing-satellite has the errors that meshes/README.md tells, to a fifth."""
    row = re.search(r"^\| error budget \| (.*) \|$", (ROOT / "meshes" / "README.md").read_text(), re.M)
    told = {part: float(size) for part, size in re.findall(r"(\w+) (\d\.\de-\d)", row[1])}
    if not run(program, folder, ["run", "wing-satellite", "--quiet", "--out", "example"]):
        return False
    found = json.loads((folder / "example" / "summary.json").read_text())["error_budget"]
    print("wing-satellite:", *(f"{part} {found[part]:.1e}, told {size:.1e};" for part, size in told.items()))
    return len(told) == 4 and all(abs(found[part] / size - 1) < 0.2 for part, size in told.items())


def main():
    found = [arguments for arguments in commands() if arguments[0] != "bench"]
    if len(found) < 10:
        sys.exit(f"README.md has {len(found)} commands of flexboom: has its form changed?")
    with tempfile.TemporaryDirectory(prefix="flexboom-readme-") as name:
        folder = pathlib.Path(name)
        shutil.copytree(ROOT / "meshes", folder / "meshes")
        (folder / "deck.inp").write_text(DECK)
        shutil.copy(ROOT / "meshes" / "two-link-arm.toml", folder / "my_scene.toml")
        good = [run(sys.argv[1], folder, arguments) for arguments in found]
        good.append(worked_example(sys.argv[1], folder))
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
