"""A world whose folder is deleted leaves the rest whole: each in turn, from a copy of the package."""

import json
import shutil
import sys
from pathlib import Path

import pytest

import racecraft

sys.path.insert(0, str(Path(__file__).parent))
from strangers import install, run_python  # noqa: E402

ROOT = Path(__file__).parents[1]
PACKAGE = Path(racecraft.__file__).parent
WORLDS = {"deepracer": "tracks", "battlesnake": "snakes", "unity": "unity", "gymnasium": "gym"}
"""The worlds, each with one of its commands."""
EVERY_MODULE = """
import importlib, pkgutil, sys, racecraft
for found in pkgutil.walk_packages(racecraft.__path__, "racecraft."):
    if found.name.split(".")[1] in ("__main__", "compat", "sagemaker"):
        continue  # they name worlds, and offer them under other packages' names
    if found.name == "racecraft.database.migrations.env":
        continue  # Alembic alone can run it
    try:
        importlib.import_module(found.name)
    except ImportError as error:
        print(found.name, error)
"""
COMMAND = "from racecraft.cli.entry import main; main()"
SMALL = ["--stop", "iterations=1", "--set", "rollout.num_worlds=2", "--set", "evaluation.every=1", "--no-pictures"]


@pytest.fixture(params=WORLDS)
def world(request):
    return request.param


@pytest.fixture
def without(world, tmp_path):
    """Run code, or a command, of a copy that lacks the world; a stranger's world is installed beside it."""
    shutil.copytree(PACKAGE, tmp_path / "src" / "racecraft", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.rmtree(tmp_path / "src" / "racecraft" / "worlds" / world)
    install(ROOT, tmp_path / "site")
    example = ROOT / "examples" / "fifth_world"
    install(example, tmp_path / "site")

    def run(*words, code=COMMAND, expected=0):
        path = [tmp_path / "src", tmp_path / "site", example]
        return run_python(code, *words, path=path, folder=tmp_path, expected=expected)

    return run


@pytest.mark.long
def test_the_rest_is_whole(world, without, tmp_path):
    assert without(code=EVERY_MODULE) == ""
    told = without("--help")
    assert f"│ {WORLDS[world]} " not in told
    assert all(f"│ {command} " in told for other, command in WORLDS.items() if other != world)
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "job.json").write_text(json.dumps({"format": "racecraft run", "version": 1, "kind": world}))
    refused = without("evaluate", "old", expected=2)
    assert f"old: found a {world.capitalize()} run; the package racecraft.worlds.{world} is not installed" in refused
    without("corridor", "train", "--run", "new", *SMALL)
    assert json.loads(without("evaluate", "new", "--json", "--episodes", "2").splitlines()[0])["episodes"] == 2
    assert "report.html" in without("report", "new")
