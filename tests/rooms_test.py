"""No include points up. Folders: fem <- reduction <- dynamics <- apps. Inside each, a room includes only those listed.

Usage: rooms_test.py PROJECT_FOLDER
"""

import pathlib
import re
import sys

FOLDERS = ["fem", "reduction", "dynamics", "apps"]
FORMATS = ["base", "mesh", "formats/common"]
# room: the rooms of its folder that it may include
ROOMS = {
    "fem": {
        "base": [],
        "linear_algebra": ["base"],
        "mesh": ["base", "linear_algebra"],
        "booms": ["base", "mesh"],
        "assembly": ["base", "linear_algebra", "mesh"],
        "formats/common": ["base", "mesh"],
        "formats/deck": ["base", "mesh"],
        "formats/abaqus": FORMATS + ["formats/deck"],
        "formats/nastran": FORMATS + ["formats/deck"],
        "formats/gmsh": FORMATS,
        "formats/vtk": FORMATS,
        "formats": FORMATS + ["formats/abaqus", "formats/nastran", "formats/gmsh", "formats/vtk"],
    },
    "reduction": {
        "body": [],
        "eigen": [],
        "basis": ["body", "eigen"],
        "body_file": ["body"],
        "invariants": ["basis", "body", "body_file"],
        "exports": ["body", "body_file"],
    },
    "dynamics": {
        "numerics": [],
        "environment": ["numerics"],
        "model": ["numerics", "environment"],
        "events": ["model"],
        "relative": ["numerics", "environment", "model", "events"],
        "redundant": ["numerics", "model", "events", "relative"],
        "methods": ["numerics", "events", "relative"],
        "simulation": ["numerics", "model", "events", "relative", "redundant", "methods"],
    },
    "apps": {
        "base": [],
        "scene": ["base"],
        "model": ["base", "scene"],
        "simulate": ["base", "scene", "model"],
        "results": ["base", "scene", "model", "simulate"],
        "bench": ["simulate"],
        "sweep": ["base", "scene", "model", "simulate", "results"],
        "commands": ["base", "scene", "model", "simulate", "results", "bench", "sweep"],
        ".": ["base", "commands"],
    },
}
INCLUDE = re.compile(r'^\s*#include "((?:fem|reduction|dynamics|apps)/[^"]+)"', re.MULTILINE)


def place(path):
    """Folder and room of a path below the project: "fem/formats/vtk/vtk.hpp" -> ("fem", "formats/vtk")."""
    folder, _, rest = path.partition("/")
    return folder, str(pathlib.PurePosixPath(rest).parent)


def faults(project):
    for folder in FOLDERS:
        known = ROOMS[folder]
        for room in known:
            if room != "." and not list((project / folder / room).glob("*.[hc]pp")):
                yield f"{folder}/{room}: no such room"
        readme = (project / folder / "README.md").read_text()
        for room in known:
            if room != "." and f"| `{room}`" not in readme:
                yield f"{folder}/README.md: the table of rooms lacks `{room}`"
        for file in sorted((project / folder).rglob("*.[hc]pp")):
            name = file.relative_to(project).as_posix()
            _, room = place(name)
            if room not in known:
                yield f"{name}: {room} is no room of {folder}"
                continue
            for target in INCLUDE.findall(file.read_text()):
                if not (project / target).exists():
                    yield f"{name}: includes {target}, which does not exist"
                other, there = place(target)
                if FOLDERS.index(other) > FOLDERS.index(folder):
                    yield f"{name}: includes {target}: {folder} is below {other}"
                if other == folder and there != room and there not in known[room]:
                    yield f"{name}: includes {target}: room {room} is not above {there}"


def cycle(known):
    """A room that can be reached from itself, or nothing."""
    def below(room, seen):
        for other in known[room]:
            if other not in seen:
                seen.add(other)
                below(other, seen)
        return seen
    return next((room for room in known if room in below(room, set())), None)


def main():
    project = pathlib.Path(sys.argv[1])
    found = list(faults(project))
    found += [f"{folder}: room {cycle(known)} is above itself" for folder, known in ROOMS.items() if cycle(known)]
    print("\n".join(found) or "every include points down")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
