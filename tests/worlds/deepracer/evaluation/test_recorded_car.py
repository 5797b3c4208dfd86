"""Which recordings are asked about their car, and what they say, by numbers that a test writes."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.worlds.deepracer.evaluation import recorded_car as module
from racecraft.worlds.deepracer.evaluation.recorded_car import recorded_car
from racecraft.worlds.deepracer.logs.errors import LogError


def touched(folder, **sizes):
    for name, size in sizes.items():
        path = folder / name.replace("__", "/").replace("_iteration", "-iteration.csv")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"x" * size)


def test_the_three_largest_traces_beside_a_racers_files_are_asked(tmp_path, monkeypatch):
    touched(tmp_path, a_iteration=5, my_trace__deep__b_iteration=9, sim_trace__c_iteration=9, trace__d_iteration=7,
            elsewhere__e_iteration=99, trace__f_notes=99)  # fmt: skip
    asked = []

    def read(path):
        asked.append(path.relative_to(tmp_path).as_posix())
        raise LogError(path, "damaged", "a trace")

    monkeypatch.setattr(module, "read_sim_trace", read)
    assert recorded_car(str(tmp_path)) is None
    assert asked == ["my_trace/deep/b-iteration.csv", "sim_trace/c-iteration.csv", "trace/d-iteration.csv"]
    assert recorded_car(tmp_path / "nothing") is None


@pytest.mark.parametrize(("windows", "tells"), [(19, False), (20, True)])
def test_the_car_that_strays_least_in_twenty_windows_is_the_recorded_one(tmp_path, monkeypatch, windows, tells):
    """Two traces of 300 rows; windows that end before a second tell nothing."""
    touched(tmp_path, a_iteration=1, b_iteration=1)
    far = {"v4": 0.5, "v5-classic": 0.1234567, "v6": 0.2}
    monkeypatch.setattr(module, "read_sim_trace", lambda path: [0] * 300)
    monkeypatch.setattr(module, "walk", lambda trace: "walked")

    parts = iter([windows - 8, 8] * 3)
    drive = lambda trace, walked, car: SimpleNamespace(  # noqa: E731
        position_m={"1s": np.array([far[car]] * next(parts) + [math.nan])}
    )
    monkeypatch.setattr(module, "drive_open_loop", drive)
    expected = ("v5-classic", {"v4": 0.5, "v5-classic": 0.1235, "v6": 0.2}, 600)
    assert recorded_car(tmp_path) == (expected if tells else None)
