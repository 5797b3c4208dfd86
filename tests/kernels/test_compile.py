"""Compiled code on disk follows the sources it was made of, whichever file they stand in."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.errors import NumbaError

import racecraft
from racecraft.kernels import inner_kernel, kernel, lean_kernel, parallel_kernel, prange
from racecraft.kernels.compile import cache_folder, is_warm, sources
from racecraft.worlds.battlesnake.env.kernels import begin, food_and_hazards, observe, outlook, rules, steps
from racecraft.worlds.deepracer.training.trainer import KERNEL

HOUSE = Path(racecraft.__file__).parent
FROZEN = "WHEELBASE_M = 0.163974\n"
"""A number of `worlds/deepracer/env/vehicle.py` that a kernel of another file has in its machine code."""
ASKED = """
from racecraft.worlds.deepracer.env.kernels.vehicle import driven_curvature
from racecraft.worlds.deepracer.env.vehicle import PROFILES
print(driven_curvature(PROFILES["v6"], 1.0, 0.3))
"""


@pytest.fixture
def house(tmp_path):
    """A copy of the package that may be edited."""
    leave = shutil.ignore_patterns("__pycache__", "catalogue", "names")
    return shutil.copytree(HOUSE, tmp_path / "src" / "racecraft", ignore=leave)


def curvature(house, **more):
    """Return what a fresh process says, with kernels kept beside the copy."""
    own = {"PYTHONPATH": str(house.parent), "RACECRAFT_CACHE": str(house.parent / "cache"), **more}
    given = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    done = subprocess.run([sys.executable, "-c", ASKED], env={**given, **own}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return float(done.stdout)


def compiled(house):
    return {path: path.stat().st_mtime_ns for path in (house.parent / "cache").rglob("*.nbc")}


def test_a_number_edited_in_another_file_is_the_kernels_at_once_and_a_warm_start_compiles_nothing(house, tmp_path):
    before = curvature(house)
    first = compiled(house)
    assert first
    assert curvature(house) == before
    assert compiled(house) == first
    elsewhere = shutil.copytree(house, tmp_path / "elsewhere" / "racecraft")  # a fresh clone beside it
    assert curvature(elsewhere, RACECRAFT_CACHE=str(house.parent / "cache")) == before
    assert compiled(house) == first
    vehicle = house / "worlds" / "deepracer" / "env" / "vehicle.py"
    assert FROZEN in vehicle.read_text(encoding="utf-8")
    vehicle.write_text(vehicle.read_text(encoding="utf-8").replace(FROZEN, "WHEELBASE_M = 0.327948\n"))
    after = curvature(house)
    assert after == pytest.approx(curvature(house, NUMBA_DISABLE_JIT="1"), rel=1e-12)
    assert after < 0.6 * before


def test_what_no_kernel_looks_at_compiles_nothing_anew():
    """An edit of a command or of a page must not cost a minute."""
    made_of = {path.relative_to(HOUSE).as_posix() for path in sources(HOUSE)}
    car = {"worlds/deepracer/env/kernels/race.py", "worlds/deepracer/env/race.py", "worlds/deepracer/env/vehicle.py"}
    assert car <= made_of
    assert {path.relative_to(HOUSE).as_posix() for path in HOUSE.rglob("kernels/*.py")} <= made_of
    assert not {path for path in made_of if path.startswith(("cli/", "api/", "training/", "analysis/"))}


def test_imports_are_followed_however_they_are_written(tmp_path):
    written = {
        "kernels/__init__.py": "",
        "kernels/sums.py": "from racecraft.a import (\n    ONE,\n)\nimport racecraft.b\nfrom racecraft import c\n",
        "a/__init__.py": "from racecraft.a.deep import ONE\n",
        "a/deep.py": "ONE = 1\n",
        "b.py": "def late():\n    from racecraft.d import FOUR\n",
        "c.py": "import numpy\n",
        "d.py": "FOUR = 4\n",
    }
    for name, text in written.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    found = [path.relative_to(tmp_path).as_posix() for path in sources(tmp_path)]
    assert found == ["a/__init__.py", "a/deep.py", "b.py", "c.py", "kernels/__init__.py", "kernels/sums.py"]


def sum_of_rows(table):
    """Add all up, a slice a row."""
    total = 0.0
    for number in range(table.shape[0]):
        row = table[number].reshape(-1)
        for place in range(row.size):
            total += row[place]
    return total


@pytest.mark.parametrize(("compiled", "counts"), [(kernel, True), (lean_kernel, False), (inner_kernel, False)])
def test_lean_kernels_count_no_holders_and_hold_none(compiled, counts, tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))  # code from the cache cannot be looked at
    table, total = np.arange(12.0).reshape(3, 4), compiled(sum_of_rows)
    held = sys.getrefcount(table)
    assert total(table) == 66.0
    assert sys.getrefcount(table) == held
    assert any("NRT_decref" in code for code in total.inspect_asm().values()) == counts


def test_a_kernel_is_machine_code_in_the_whole_that_python_calls_and_by_itself_once_python_calls_it(
    tmp_path, monkeypatch
):
    """Compiled at first; then from the disk as a part, and as a whole, by callers that the disk does not know."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    def halved(number):
        if number < 0.0:
            raise ValueError("below zero")  # for which code must know of Python
        return 0.5 * number

    for callers in range(3):
        half = kernel(halved)

        @parallel_kernel
        def halve(numbers, halves):
            for place in prange(numbers.shape[0]):
                halves[place] = half(numbers[place]) + callers  # noqa: B023

        halves = np.zeros(3)
        halve(np.arange(3.0), halves)
        assert halves.tolist() == [callers, callers + 0.5, callers + 1.0]
        (part,) = half.overloads.values()
        assert part.library.is_part == (callers < 2)
        assert (sum(half.stats.cache_misses.values()) > 0) == (callers == 0)
        if callers:
            assert half(3.0) == 1.5
            with pytest.raises(ValueError, match="below zero"):
                half(-1.0)


def test_a_lean_kernel_that_makes_an_array_does_not_compile(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    with pytest.raises(NumbaError, match="NRT required"):
        lean_kernel(lambda table: table.copy()[0])(np.zeros(3))


def test_nothing_that_a_game_calls_each_turn_counts_holders():
    """One that does makes the turn three times as long."""
    for room in (begin, food_and_hazards, observe, outlook, rules, steps):
        compiled = {name: value for name, value in vars(room).items() if hasattr(value, "py_func")}
        own = {name for name, value in compiled.items() if value.py_func.__module__ == room.__name__}
        assert own
        assert [name for name in own if compiled[name].targetoptions.get("_nrt") is not False] == []


def test_a_first_training_is_one_whose_own_kernel_was_never_compiled(tmp_path, monkeypatch):
    """Others of this version may have been: by a game between snakes, or a picture of a track."""
    monkeypatch.setenv("RACECRAFT_CACHE", str(tmp_path))
    (cache_folder() / "kernels_0").mkdir(parents=True)
    (cache_folder() / "kernels_0" / "geometry.nearest-9.py311.1.nbc").touch()
    assert not is_warm(KERNEL)
    (cache_folder() / "kernels_0" / "race.tick-82.py311.1.nbc").touch()
    assert is_warm(KERNEL)
    file, function = KERNEL.split(".")
    text = (HOUSE / "worlds" / "deepracer" / "env" / "kernels" / f"{file}.py").read_text(encoding="utf-8")
    assert f"\ndef {function}(" in text


@pytest.mark.parametrize(
    ("version", "kind"), [((0, 62), "CPUDispatcher"), ((0, 68), "Kernel"), ((1, 0), "CPUDispatcher")]
)
def test_a_version_of_numba_that_nobody_tried_compiles_its_own_way(version, kind, tmp_path):
    code = (
        f"import numba; numba.version_info = numba.version_info._replace(major={version[0]}, minor={version[1]})\n"
        "from racecraft.kernels import inner_kernel, kernel\n"
        "twice = inner_kernel(lambda number: 2.0 * number)\n"
        "thrice = kernel(lambda number: twice(number) + number)\n"
        "print(type(thrice).__name__, thrice(1.5))"
    )
    (tmp_path / "mine.py").write_text(code)  # what is kept on disk needs a file
    done = subprocess.run([sys.executable, tmp_path / "mine.py"], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [kind, "4.5"]
