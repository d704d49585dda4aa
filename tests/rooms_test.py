"""No include points up. Folders: fem <- reduction <- dynamics <- apps. Inside each, a room includes only those listed.
A header that is installed includes only those that are.
Documents that are named exist, and so do their sections.

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
        "redundant": ["numerics", "model", "events"],
        "methods": ["numerics", "events", "relative"],
        "simulation": ["numerics", "model", "events", "relative", "redundant", "methods"],
    },
    "apps": {
        "base": [],
        "scene": ["base"],
        "model": ["base", "scene"],
        "simulate": ["base", "scene", "model"],
        "accuracy": ["base", "scene", "model", "simulate"],
        "results": ["base", "scene", "model", "simulate", "accuracy"],
        "bench": ["simulate", "accuracy"],
        "sweep": ["base", "scene", "model", "simulate", "accuracy", "results"],
        "commands": ["base", "scene", "model", "simulate", "accuracy", "results", "bench", "sweep"],
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


INSTALLED = re.compile(r"flexboom_library\(.*?HEADERS\n(.*?)SOURCES", re.DOTALL)


def installation_faults(project):
    """Headers that are installed and include one that is not."""
    installed = {f"{folder}/{name}" for folder in FOLDERS
                 for name in INSTALLED.search((project / folder / "CMakeLists.txt").read_text())[1].split()}
    for name in sorted(installed):
        for target in INCLUDE.findall((project / name).read_text()):
            if target not in installed:
                yield f"{name}: is installed and includes {target}, which is not"


def cycle(known):
    """A room that can be reached from itself, or nothing."""
    def below(room, seen):
        for other in known[room]:
            if other not in seen:
                seen.add(other)
                below(other, seen)
        return seen
    return next((room for room in known if room in below(room, set())), None)


TOLD = (".hpp", ".cpp", ".py", ".md", ".toml")
DOCUMENT = re.compile(r"(?<![}\w/])[\w.][\w./-]*\.md\b")
SECTION = re.compile(r"\b(?:[Ss]ection|[Cc]hapter) (\d+)\b(?!\.\d)")
HEADING = re.compile(r"^## (\d+) ", re.MULTILINE)
LITERATURE = re.compile(r"^## (?:References|Literature)$.*", re.MULTILINE | re.DOTALL)
# Of those who work on the project, not part of it; in two halves, so that they are not named here.
ELSEWHERE = [a + b for a, b in (("FORM", "ULATION"), ("DES", "IGN." "md"), ("INTER", "FACE." "md"), ("ST", "YLE." "md"),
                                ("HARD", "_CASES"))]


def files_told(project):
    for top in sorted(project.iterdir()):
        if top.name in ("build", "results") or top.name.startswith("."):
            continue
        for file in sorted(top.rglob("*") if top.is_dir() else [top]):
            if file.suffix in TOLD:
                yield file


def document_faults(project):
    """Documents and sections that are named and are not there."""
    files = list(files_told(project))
    there = {f.resolve() for f in files}

    def found(name, file):
        top = project / file.relative_to(project).parts[0]
        for folder in (file.parent, top, project):
            if (folder / name).resolve() in there:
                return folder / name
        return next((f for f in files if f.as_posix().endswith("/" + name)), None)

    for file in files:
        own = file.relative_to(project)
        text = file.read_text(errors="replace")
        for word in ELSEWHERE:
            if word in text:
                yield f"{own}: names {word}, which is no part of the project"
        for number, line in enumerate(LITERATURE.sub("", text).splitlines(), 1):
            named = DOCUMENT.findall(line)
            for name in named:
                if found(name, file) is None:
                    yield f"{own}:{number}: names {name}, which does not exist"
            for section in SECTION.findall(line):
                readme = next(filter(None, (found(n, file) for n in named)), project / own.parts[0] / "README.md")
                if not readme.is_file() or section not in HEADING.findall(readme.read_text()):
                    yield f"{own}:{number}: {readme} has no section {section}"


def main():
    project = pathlib.Path(sys.argv[1])
    found = [*faults(project), *installation_faults(project), *document_faults(project.resolve())]
    found += [f"{folder}: room {cycle(known)} is above itself" for folder, known in ROOMS.items() if cycle(known)]
    print("\n".join(found) or "every include points down, and every document that is named is there")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
