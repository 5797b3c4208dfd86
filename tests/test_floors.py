"""Imports point down: the house is walked and every door is looked at."""

import ast
import subprocess
import sys
from pathlib import Path

import racecraft

HOUSE = Path(racecraft.__file__).parent

FLOOR = {
    "contract": 0, "kernels": 0, "settings": 0, "formats": 0, "tracks": 0,
    "envs": 1, "algorithms": 1,
    "rollout": 2, "players": 2,
    "evaluation": 3, "analysis": 3, "export": 3,
    "training": 4, "reporting": 4,
    "jobs": 5, "league": 5,
    "console": 6, "serving": 6, "lessons": 6, "compat": 6,
    "cli": 7,
}  # fmt: skip

# Within floor 0, what the others are made of.
GROUND = {"contract": 0, "kernels": 1, "settings": 1, "formats": 2, "tracks": 3}

HEAVY = {
    "torch": {"algorithms", "rollout", "export", "analysis", "training"},
    "ray": {"training", "jobs"},
    "grpc": {"envs"},
    "sqlalchemy": {"jobs", "league"},
    "fastapi": {"console", "serving"},
    "nicegui": {"console"},
    "matplotlib": {"analysis", "tracks"},
    "av": {"analysis"},
    "pandas": {"analysis"},
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
