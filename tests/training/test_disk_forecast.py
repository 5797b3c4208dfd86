"""What checkpoints will take of the disk is said where it matters, and comes true."""

from dataclasses import fields

import numpy as np
import pytest

from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.errors import SettingError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.training import disk_forecast
from racecraft.training.disk_forecast import forecast
from racecraft.training.settings import RuntimeConfig, keep_override
from racecraft.training.stopping import parse_stops

WEIGHTS = {"w": np.zeros(250_000, np.float32)}  # 1 MB


@pytest.mark.parametrize(
    ("settings", "kept"),
    [({}, 41), ({"keep_every": 10}, 8), ({"keep_count": 3}, 7), ({"keep_mib": 10}, 41)],
)
def test_the_forecast_bounds_what_is_written(tmp_path, settings, kept):
    runtime = RuntimeConfig(**settings)
    told = forecast(WEIGHTS, runtime, parse_stops(["steps=4000", "minutes=60"]), 100, tmp_path)
    assert told.kept == kept
    shelf = Checkpoints(tmp_path, runtime.keep_mib * 2**20, runtime.keep_every, runtime.keep_count)
    state = {"learner": {name: np.zeros((3, 250_000), np.float32) for name in WEIGHTS}}
    for iteration in range(41):
        shelf.save(iteration, 100 * iteration, WEIGHTS, {}, state)
    written = sum(path.stat().st_size for path in tmp_path.glob("*.safetensors"))
    assert 0.4 * told.total < written <= 1.01 * told.total


def test_it_is_said_where_it_fills_the_disk(tmp_path, monkeypatch):
    stops = parse_stops(["iterations=100"])
    monkeypatch.setattr(disk_forecast.shutil, "disk_usage", lambda path: type("", (), {"free": 10**11}))
    assert forecast(WEIGHTS, RuntimeConfig(), stops, 1, tmp_path).sentence() == ""
    monkeypatch.setattr(disk_forecast.shutil, "disk_usage", lambda path: type("", (), {"free": 10**8}))
    sentence = forecast(WEIGHTS, RuntimeConfig(), stops, 1, tmp_path).sentence()
    assert sentence == (
        "checkpoints take up to 0.11 GB of the disk (1 MB each, 101 kept); 0.1 GB are free. "
        "--keep best,last,10 keeps fewer."
    )


@pytest.mark.parametrize("text", ["last,best,3", "best,last,many"])
def test_what_is_no_choice_is_refused(text):
    with pytest.raises(SettingError, match="expected all, best,last"):
        keep_override(text)


def test_best_and_last_alone_are_a_choice():
    assert keep_override("best, last") == "runtime.keep_count=0"


def test_help_says_how_many_stay():
    (keep,) = [one for one in fields(TrainingOptions) if one.name == "keep"]
    assert f"best,last,{RuntimeConfig.keep_count}" in str(keep.metadata)
