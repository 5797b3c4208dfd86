"""The public Python surface: one verb each, on every kind of world, and nothing heavy before it is asked for."""

import subprocess
import sys

import numpy as np
import pytest

import racecraft as rc
from racecraft.contract.errors import SettingError
from racecraft.contract.world import allocate

SMALL = {"rollout.num_worlds": 2, "rollout.horizon": 16, "network.hidden_units": (8,), "ppo.epochs": 1}


def test_importing_brings_nothing_heavy():
    heavy = ("torch", "numba", "polars", "matplotlib")
    code = f"import sys, racecraft; print(*[name for name in {heavy} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "\n"


def test_a_run_is_trained_read_judged_gone_on_with_and_its_policy_acts(tmp_path):
    trained = rc.train(
        "gymnasium", environment="CartPole-v1", settings=SMALL, stops="iterations=2", run=tmp_path / "run", quiet=True
    )
    assert trained.summary()["iterations"] == 2
    run = rc.read_run(tmp_path / "run")
    assert (run.kind, run.job["settings"]["network"]["hidden_units"]) == ("gymnasium", [8])
    assert run.metrics()["iteration"].to_list() == [1, 2]
    assert [one.iteration for one in run.checkpoints] == [0, 1, 2]
    policy = rc.load_policy(f"{tmp_path / 'run'}:last")
    assert policy.act({"observation": np.zeros((3, 4), np.float32)}).shape == (3,)
    judged = rc.evaluate(tmp_path / "run", episodes=4)
    assert (judged["checkpoint"], judged["episodes"]) == (2, 4)
    assert judged["mean_return"] == pytest.approx(judged["mean_steps"])  # CartPole pays a point a step
    assert rc.resume(tmp_path / "run", stops="iterations=3", quiet=True).outcome.iterations == 3


def test_a_run_that_was_never_evaluated_hands_over_what_was_trained(tmp_path):
    """Not the untrained policy that it began with."""
    rc.train(
        "gymnasium", environment="CartPole-v1", settings={**SMALL, "evaluation.every": 50}, stops="iterations=1",
        run=tmp_path / "run", quiet=True,
    )  # fmt: skip
    assert rc.load_policy(tmp_path / "run").checkpoint.iteration == 1


def test_each_kind_of_world_can_be_stepped_by_hand():
    for kind, words in (
        ("deepracer", {"track": "Oval_track", "num_cars": 2, "actions": [(30, 1.0), (0, 2.0)]}),
        ("battlesnake", {"width": 7, "height": 7, "players": 2, "num_games": 3}),
        ("gymnasium", {"environment": "Pendulum-v1", "num_worlds": 2}),
    ):
        world = rc.make_world(kind, **words)
        buffers = allocate(world.spec)
        world.reset(buffers, seed=1)
        shape = (world.spec.num_worlds, world.spec.num_agents, *world.spec.actions.shape)
        world.step(np.zeros(shape, world.spec.actions.dtype), buffers)
        assert np.isfinite(buffers.reward).all()
        world.close()


def test_a_word_that_nobody_knows_is_refused_with_the_nearest():
    with pytest.raises(SettingError, match="there is no option 'enviroment'. Did you mean 'environment'"):
        rc.train("gymnasium", enviroment="CartPole-v1")
    with pytest.raises(SettingError, match="Did you mean 'gymnasium'"):
        rc.train("gymnasum", environment="CartPole-v1")
    with pytest.raises(SettingError, match="Did you mean 'deepracer'"):
        rc.make_world("depracer")
