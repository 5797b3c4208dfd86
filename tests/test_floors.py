"""Imports point down: the house is walked and every door is looked at."""

import ast
import subprocess
import sys
from pathlib import Path

import racecraft

HOUSE = Path(racecraft.__file__).parent

FLOOR = {
    "contract": 0, "kernels": 0, "settings": 0, "formats": 0, "tracks": 0, "storage": 0,
    "envs": 1, "algorithms": 1,
    "rollout": 2, "players": 2,
    "evaluation": 3, "analysis": 3, "export": 3, "logs": 3,
    "training": 4, "reporting": 4,
    "jobs": 5, "cluster": 5, "league": 5,
    "console": 6, "serving": 6, "lessons": 6, "compat": 6, "api": 6, "estimator": 6,
    "cli": 7,
}  # fmt: skip

# Inside training, the rooms of the worlds import the general files, never the reverse.
TRAINING_WORLDS = ("deepracer", "battlesnake", "gymnasium", "unity")

# Within floor 0, what the others are made of.
GROUND = {"contract": 0, "kernels": 1, "settings": 1, "formats": 2, "tracks": 3, "storage": 3}

HEAVY = {
    "torch": {"algorithms", "rollout", "export", "analysis", "training", "compat"},
    "ray": {"cluster"},
    "mlflow": {"training"},
    "grpc": {"envs"},
    "sqlalchemy": {"jobs"},
    "optuna": {"jobs"},
    "fastapi": {"console", "serving"},
    "nicegui": {"console"},
    "matplotlib": {"analysis", "tracks"},
    "av": {"analysis"},
    "onnx": {"export"},
    "onnxruntime": {"export"},
    "openvino": {"export"},
    "tensorflow": {"export"},
    "pandas": {"analysis", "jobs", "logs"},
    "s3fs": {"storage"},
    "fsspec": {"storage"},
}


def doors():
    """Yield (room, imported module, file) for every import anywhere in the package."""
    for path in sorted(HOUSE.rglob("*.py")):
        room = path.relative_to(HOUSE).parts[0].removesuffix(".py")
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                yield from ((room, alias.name, path) for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{path}: imports inside the house are written out in full"
                yield room, node.module or "", path


def test_every_door_opens_downward():
    climbing = []
    for room, module, path in doors():
        parts = module.split(".")
        if parts[0] != "racecraft" or len(parts) < 2 or room in ("__init__", "__main__") or parts[1] == room:
            continue
        used = parts[1]
        downward = FLOOR[used] < FLOOR[room] or (FLOOR[used] == FLOOR[room] == 0 and GROUND[used] < GROUND[room])
        if not downward:
            climbing.append(f"{path.relative_to(HOUSE)} -> {module}")
    assert climbing == []


def test_general_files_of_training_know_no_world():
    knowing = []
    for room, module, path in doors():
        inside = path.relative_to(HOUSE).parts
        parts = module.split(".")
        general = room == "training" and inside[1] not in TRAINING_WORLDS
        if general and parts[:2] == ["racecraft", "training"] and len(parts) > 2 and parts[2] in TRAINING_WORLDS:
            knowing.append(f"{path.relative_to(HOUSE)} -> {module}")
    assert knowing == []


def module_of(path):
    parts = ["racecraft", *path.relative_to(HOUSE).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_at_the_top(path):
    """Yield what a file imports when it is imported itself: not inside functions, not for the type checker alone."""
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_there_is_no_circle_anywhere_in_the_house():
    """Files import each other in one direction only, inside a room as between rooms."""
    files = {module_of(path): path for path in sorted(HOUSE.rglob("*.py")) if "names" not in path.parts}
    graph = {name: {used for used in imports_at_the_top(path) if used in files} for name, path in files.items()}
    packages = {name for name, path in files.items() if path.name == "__init__.py"}
    for name, used in graph.items():  # a package that gathers its own files is no circle
        graph[name] = {one for one in used if one != name and one not in packages}
    done, circles = set(), []

    def visit(name, way):
        if name in way:
            circles.append(" -> ".join([*way[way.index(name) :], name]))
        elif name not in done:
            for used in sorted(graph[name]):
                visit(used, [*way, name])
            done.add(name)

    for name in graph:
        visit(name, [])
    assert circles == []


def test_worlds_are_strangers_to_each_other():
    together = []
    for _, module, path in doors():
        parts = module.split(".")
        inside = path.relative_to(HOUSE).parts
        crossing = parts[:2] == ["racecraft", "envs"] and inside[0] == "envs" and len(parts) > 2
        if crossing and parts[2] != inside[1] and inside[1] != "adapters" and parts[2] != "adapters":
            together.append(f"{path.relative_to(HOUSE)} -> {module}")
    assert together == []


def test_heavy_guests_enter_by_few_doors():
    strays = [
        f"{path.relative_to(HOUSE)} -> {module}"
        for room, module, path in doors()
        if (guest := module.split(".")[0]) in HEAVY and room not in HEAVY[guest]
    ]
    assert strays == []


def test_help_needs_no_heavy_guest():
    """`racecraft --help` answers at once because nothing heavy is imported for it."""
    heavy = ("torch", "numba", "matplotlib", "polars")
    code = f"import sys, racecraft.cli.app; print(*[name for name in {heavy} if name in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == ""
