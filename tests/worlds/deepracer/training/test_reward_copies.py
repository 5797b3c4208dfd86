"""Each car is paid by its own copy of the reward, in training and where checkpoints are judged by reward."""

import json

import numpy as np
import polars
import pytest
from tests.cli.conftest import TINY

from racecraft.contract.errors import ContractError
from racecraft.contract.world import allocate
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.adapter import race_world
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.settings import CameraConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.plan import RaceRequest

COUNTS = "calls = 0\ndef reward_function(params):\n    global calls\n    calls += 1\n    return calls\n"


@pytest.fixture
def trained(tmp_path):
    (tmp_path / "car").mkdir()
    (tmp_path / "car" / "reward_function.py").write_text(COUNTS)
    request = RaceRequest(
        tmp_path / "car",
        stops=("iterations=1",),
        run=tmp_path / "r",
        overrides=(*TINY[1::2], "evaluation.best_by=reward"),
    )
    return train(request, NullCallback(), lambda _: None)


def test_every_car_counts_its_own_calls(trained):
    ticks = polars.read_parquet(trained.run.episodes / "1.parquet").sort("world", "episode", "tick")
    assert ticks["world"].n_unique() == 4
    for _, rows in ticks.group_by("world"):
        paid = rows.filter(polars.col("status") != "prepare")["reward"].to_list()
        assert paid == [float(k) for k in range(1, len(paid) + 1)]


def test_every_judged_car_counts_its_own_calls(trained):
    """By hand: n paid ticks of a car that counts from 1 add up to n (n + 1) / 2; the tick of preparing is not paid."""
    laps = json.loads((trained.run.evaluations / "1.json").read_text())["laps"]
    assert len(laps) == 2
    for lap in laps:
        paid = lap["steps"] - 1
        assert lap["reward"] == paid * (paid + 1) / 2


def test_a_world_pays_each_car_by_its_own_function_and_wants_as_many_as_cars():
    track, actions = load_track("reinvent_base"), ActionTable.of([(0.0, 1.0)])
    pays = [lambda params, k=k: float(k) for k in range(3)]
    world = RaceWorld(track, actions, pays, camera_config=CameraConfig(16, 12), num_cars=3)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    for _ in range(2):
        world.step(np.zeros((3, 1), np.int64), buffers)
    assert buffers.reward[:, 0].tolist() == [0.0, 1.0, 2.0]
    with pytest.raises(ContractError, match="3 reward functions were given; expected one for all or 4"):
        RaceWorld(track, actions, pays, num_cars=4)


def test_cars_of_gymnasium_have_copies_of_a_file_too(tmp_path):
    (tmp_path / "reward_function.py").write_text(COUNTS)
    world = race_world(num_cars=2, reward=tmp_path / "reward_function.py", width=16, height=12)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    for _ in range(3):
        world.step(np.zeros((2, 1), np.int64), buffers)
    assert buffers.reward[:, 0].tolist() == [2.0, 2.0]
