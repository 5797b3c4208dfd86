"""Worlds are found by their entry points, ours as a stranger's."""

import dataclasses
import re
import subprocess
import sys
from pathlib import Path

import pytest

from racecraft.contract.kind import PANELS, WorldKind, load
from racecraft.contract.kinds import MissingWorldError, find_kind, kind_names, kinds

OURS = ["battlesnake", "deepracer", "gymnasium", "unity"]
TARGET = re.compile(r"[\w.]+\.[\w.]+(:\w+)?")


def targets(kind):
    """Yield every piece of code that a kind names."""
    for field in dataclasses.fields(kind):
        value = getattr(kind, field.name)
        for one in value.values() if isinstance(value, dict) else [value]:
            yield from (part for part in (one if isinstance(one, tuple) else [one]) if is_target(part))
    yield from (command.target for command in kind.commands)


def is_target(value):
    return isinstance(value, str) and TARGET.fullmatch(value) is not None


def test_our_worlds_are_installed():
    assert set(OURS) <= set(kind_names())


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.name)
def test_every_piece_that_a_kind_names_is_there(kind):
    assert all(load(target) is not None for target in targets(kind))
    assert kind.piece("training").Request.kind == kind.name
    assert {command.panel for command in kind.commands} <= set(PANELS)


def test_a_hook_that_is_left_out_is_none():
    assert WorldKind("a", "A", training="math").piece("evaluate") is None


def test_an_unknown_kind_is_refused_with_the_nearest():
    with pytest.raises(MissingWorldError, match="Did you mean 'deepracer'"):
        find_kind("deepraser")


def test_the_kinds_themselves_bring_no_world_along():
    """To list what is installed imports four small modules and nothing of the worlds."""
    code = "import sys; from racecraft.contract.kinds import kind_names; kind_names(); print(*sys.modules)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    worlds = {name for name in found if name.startswith("racecraft.worlds.")}
    assert {name for name in worlds if name.count(".") > 2} == {f"racecraft.worlds.{name}.kind" for name in OURS}
    assert not {"torch", "numba", "numpy", "polars"} & set(found)


def asked_in(folder: Path, code: str) -> subprocess.CompletedProcess:
    """Run Python where a folder comes first on the path."""
    path = f"import sys; sys.path.insert(0, {str(folder)!r})\n"
    return subprocess.run([sys.executable, "-c", path + code], capture_output=True, text=True)


def make_dist(folder: Path, name: str, entries: str) -> None:
    """Lay down what pip would lay down of a package's entry points."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[racecraft.worlds]\n{entries}\n")


def test_a_world_whose_package_is_gone_is_refused_by_name_and_left_out_of_lists(tmp_path):
    make_dist(tmp_path, "gone", "gone = gone_world.kind:KIND")
    code = """
from racecraft.contract.errors import UserInputError
from racecraft.contract.kinds import find_kind, kind_names
print(kind_names())
for whose in ("runs/a-1", ""):
    try:
        find_kind("gone", whose)
    except UserInputError as error:
        print(error)
"""
    told = asked_in(tmp_path, code).stdout.splitlines()
    assert told[0] == str(OURS)
    assert told[1] == "runs/a-1: found a Gone run; the package gone_world is not installed."
    assert "the package gone_world is not installed" in told[2]


def test_metadata_older_than_the_code_is_told(tmp_path):
    make_dist(tmp_path, "racecraft", "")
    code = "from racecraft.contract.kinds import find_kind; find_kind('gymnasium')"
    assert "pip install --no-deps -e ." in asked_in(tmp_path, code).stderr
