"""Trainings whose workers find the gradients: they learn what they would learn if the learner found them."""

import json

import numpy as np
import pytest
import torch
from tests.cluster.test_spread_training import assert_same, cars, cart, curve, snakes, weights
from tests.cluster.workers_here import spread_here

from racecraft.cluster.transport import ClusterError
from racecraft.contract.errors import SettingError
from racecraft.training.callbacks import Silent
from racecraft.training.worlds import resume, train

AVERAGED = "cluster.gradients=workers"
FEW = ("ppo.epochs=2", "ppo.batch_size=32")
EPISODES = ("rollout.episodes_per_iteration=8", "rollout.memory_steps=150")
TRAININGS = {
    "choices": lambda run, *more: cart(run, *FEW, *more, stops="iterations=3"),
    "numbers": lambda run, *more: cart(run, *FEW, *more, environment="Pendulum-v1", stops="iterations=3"),
    "whole episodes": lambda run, *more: cart(
        run, *FEW, "rollout.episodes_per_iteration=8", *more, stops="iterations=3"
    ),
    "cars": lambda run, *more: cars(run, *FEW, *more),
    "snakes": lambda run, *more: snakes(run, *FEW, *more),
}


@pytest.fixture(autouse=True)
def _threads_as_before():
    threads = torch.get_num_threads()
    yield
    torch.set_num_threads(threads)


def trained(request, workers=2, **more):
    """Train by workers in this process; return their transport and what was said."""
    spread, transport = spread_here(workers, **more)
    said = []
    train(request, Silent(), said.append, spread)
    return transport, said


def assert_alike(one, other):
    """Compare what two trainings learned: the same, but for the rounding of sums and what follows from it."""
    for mine, theirs in zip(curve(one), curve(other), strict=True):
        assert mine["steps"] == theirs["steps"]
        for name in ("policy_loss", "value_loss", "entropy", "approx_kl", "explained_variance", "mean_advantage"):
            assert mine[name] == pytest.approx(theirs[name], rel=1e-3, abs=1e-4), name
    mine, theirs = weights(one), weights(other)
    assert all(np.allclose(mine[name], theirs[name], rtol=1e-3, atol=1e-4) for name in mine | theirs)


@pytest.mark.parametrize("workers", [1, 2, 3])
@pytest.mark.parametrize("name", TRAININGS)
def test_workers_find_what_the_learner_finds(tmp_path, name, workers):
    alone, averaged = tmp_path / "alone", tmp_path / "averaged"
    trained(TRAININGS[name](alone), workers)
    transport, _ = trained(TRAININGS[name](averaged, AVERAGED), workers)
    assert transport.asked.count("find") == workers * sum(int(row["minibatches"]) for row in curve(averaged))
    assert_alike(alone, averaged)


def test_frames_do_not_travel_and_what_does_is_said(tmp_path):
    _, said = trained(TRAININGS["cars"](tmp_path / "frames"))
    _, told = trained(TRAININGS["cars"](tmp_path / "averaged", AVERAGED))
    came = [float(line.split()[1].replace(",", "")) for line in (said[-1], told[-1])]
    assert came[0] > 1000
    assert came[1] < came[0] / 3, "where each worker stands goes on travelling, once a rollout of 16 ticks"
    assert any("workers found the gradients of" in line for line in told)


@pytest.mark.parametrize(("lost", "finding"), [((), (0, 5, 11, 12, 17)), ((1, 3), (2, 9))])
@pytest.mark.parametrize("name", ["numbers", "cars", "snakes"])
def test_workers_lost_in_the_middle_of_an_update_change_nothing(tmp_path, name, lost, finding):
    quiet, wild = tmp_path / "quiet", tmp_path / "wild"
    trained(TRAININGS[name](quiet, AVERAGED))
    transport, said = trained(TRAININGS[name](wild, AVERAGED), lost_at=lost, lost_at_find=finding)
    assert transport.ended == len(lost) + len(finding)
    assert sum("was lost" in line for line in said) == len(lost) + len(finding)
    assert_same(quiet, wild)


def test_a_place_that_loses_every_worker_in_an_update_is_named(tmp_path):
    spread, transport = spread_here(1, lost_at_find=tuple(range(8, 20)))
    with pytest.raises(ClusterError, match="5 workers one after the other were lost in place 0"):
        train(TRAININGS["choices"](tmp_path / "run", AVERAGED), Silent(), lambda text: None, spread)
    assert transport.closed
    assert len(curve(tmp_path / "run")) == 2, "what was learned until then stands"


def test_a_run_goes_on_to_the_same_curve(tmp_path):
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    trained(cart(whole, *FEW, AVERAGED, stops="iterations=4"))
    trained(cart(broken, *FEW, AVERAGED, stops="iterations=2"))
    resume(broken, ("iterations=4",), Silent(), lambda text: None, spread=spread_here(2)[0])
    assert_same(whole, broken)


def test_without_a_cluster_the_learner_finds_its_own(tmp_path):
    train(cart(tmp_path / "asked", AVERAGED, stops="iterations=2"), Silent(), lambda text: None)
    train(cart(tmp_path / "not", stops="iterations=2"), Silent(), lambda text: None)
    assert_same(tmp_path / "asked", tmp_path / "not")


@pytest.mark.parametrize(
    ("words", "letter"),
    [
        (("ppo.asynchronous=true",), "ppo.asynchronous True, which learns while workers collect"),
        (("network.memory=lstm",), "network.memory lstm, which learns from stretches"),
        (("network.stack_size=3",), "network.stack_size 3, which lays frames"),
        (("network.normalise=true",), "network.normalise True, whose statistics"),
        (("curiosity.strength=0.1",), "curiosity.strength 0.1, which learns from all"),
        (("cluster.send=actions",), "cluster.send actions, where nothing that was seen"),
        (("ppo.batch_size=2",), r"3 of them, and ppo.batch_size is 2; .*--cluster 2"),
    ],
)
def test_what_needs_all_rows_in_one_place_is_named(tmp_path, words, letter):
    spread, transport = spread_here(3)
    with pytest.raises(SettingError, match=f"cluster.gradients is workers.*{letter}"):
        train(cart(tmp_path / "run", AVERAGED, *words), Silent(), lambda text: None, spread)
    assert not transport.asked
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("algorithm", ["dqn", "reinforce"])
def test_only_ppo_is_averaged(tmp_path, algorithm):
    spread, transport = spread_here(2)
    with pytest.raises(SettingError, match=f"{algorithm} finds its own; expected --algorithm ppo"):
        train(cart(tmp_path / "run", AVERAGED, algorithm=algorithm), Silent(), lambda text: None, spread)
    assert not transport.asked


def test_environments_send_no_actions(tmp_path):
    with pytest.raises(SettingError, match="cluster.send is actions"):
        train(cart(tmp_path / "run", "cluster.send=actions"), Silent(), lambda text: None, spread_here(2)[0])


def test_the_job_tells_who_found_the_gradients(tmp_path):
    trained(cart(tmp_path / "run", AVERAGED, stops="iterations=1"))
    job = json.loads((tmp_path / "run" / "job.json").read_text())
    assert job["settings"]["cluster"]["gradients"] == "workers"
