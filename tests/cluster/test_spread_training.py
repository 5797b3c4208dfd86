"""Trainings whose worlds are carried by workers, without Ray: what must be the same as in one process is the same."""

import json
import re

import numpy as np
import pytest
import torch
from tests.cluster.workers_here import spread_here

from racecraft.cluster import worker_pool
from racecraft.cluster.transport import ClusterError
from racecraft.cluster.worker_pool import LOST_IN_A_ROW
from racecraft.contract.errors import SettingError, UserInputError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.training.trainer import SnakeRequest
from racecraft.worlds.deepracer.training.plan import RaceRequest
from racecraft.worlds.gymnasium.training.trainer import GymRequest

SMALL = (
    "rollout.num_worlds=4",
    "rollout.horizon=16",
    "evaluation.every=2",
    "evaluation.episodes=2",
    "network.hidden_units=8",
    "runtime.threads=1",
)


def cart(run, *more, algorithm="ppo", environment="CartPole-v1", stops="iterations=6"):
    return GymRequest(environment, algorithm=algorithm, run=run, stops=(stops,), overrides=(*SMALL, *more))


def snakes(run, *more):
    game = GameSettings(7, 7, 2, "standard", "standard")
    kept = ("selfplay.pool_every=2", "evaluation.episodes=1", "rollout.num_worlds=8", *more)
    return SnakeRequest(game, run=run, stops=("iterations=5",), overrides=(*SMALL, *kept))


def cars(run, *more):
    return RaceRequest(run=run, preset="fast", stops=("iterations=4",), overrides=(*SMALL[:4], SMALL[5], *more))


def curve(run):
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    return [
        {name: value for name, value in row.items() if not name.startswith(("seconds", "steps_per"))} for row in rows
    ]


def weights(run):
    return Checkpoints(run / "checkpoints").load_policy("last")[0]


def assert_same(one, other):
    assert curve(one) == curve(other)
    mine, theirs = weights(one), weights(other)
    assert all(np.array_equal(mine[name], theirs[name]) for name in mine | theirs)


ALIKE = {
    "ppo": lambda run: cart(run),
    "ppo with a memory": lambda run: cart(run, "network.memory=lstm", "ppo.batch_size=32"),
    "ppo with curiosity": lambda run: cart(run, "curiosity.strength=0.1"),
    "ppo whose learner is beside": lambda run: cart(run, "ppo.asynchronous=true"),
    "ppo whose rollouts grow": lambda run: cart(
        run, "rollout.horizon=1", "rollout.longest_horizon=2", "evaluation.every=50", stops="iterations=132"
    ),
    "reinforce": lambda run: cart(run, algorithm="reinforce"),
    "cars": lambda run: cars(run),
    "snakes": lambda run: snakes(run),
}


@pytest.mark.parametrize("name", ALIKE)
def test_one_worker_gives_the_curve_of_one_process(tmp_path, name):
    here, there = tmp_path / "here", tmp_path / "there"
    train(ALIKE[name](here), NullCallback(), lambda text: None)
    spread, transport = spread_here(1)
    train(ALIKE[name](there), NullCallback(), lambda text: None, spread)
    assert transport.asked.count("collect") >= 4
    assert transport.closed
    assert_same(here, there)


@pytest.mark.parametrize("name", ["dqn", "sac"])
def test_what_remembers_takes_its_new_weights_a_collecting_later(tmp_path, name):
    """Workers begin the next collecting before the learner has learned from this one, so no bits are compared."""
    spread, _ = spread_here(2)
    environment = "Pendulum-v1" if name == "sac" else "CartPole-v1"
    request = cart(tmp_path / "run", "replay.learning_starts=64", algorithm=name, environment=environment)
    trained = train(request, NullCallback(), lambda text: None, spread)
    assert trained.outcome.steps == 6 * 4 * 16
    untrained = Checkpoints(tmp_path / "run" / "checkpoints").load_policy("0")[0]
    assert any(not np.array_equal(part, untrained[name]) for name, part in weights(tmp_path / "run").items())


def test_apex_has_its_ladder_over_the_rows_of_all_workers(tmp_path, monkeypatch):
    from racecraft.algorithms.apex import ApexLearner

    shares, act = set(), ApexLearner.act

    def noted(self, observations, action_mask=None, *, generator=None, rows=None):
        shares.update(self.ladder[torch.from_numpy(rows)].tolist())
        return act(self, observations, action_mask, generator=generator, rows=rows)

    monkeypatch.setattr(ApexLearner, "act", noted)
    spread, _ = spread_here(2)
    train(cart(tmp_path / "run", algorithm="apex"), NullCallback(), lambda text: None, spread)
    assert len(shares) == 4
    assert max(shares) == pytest.approx(0.4)


@pytest.fixture(scope="module")
def of_two_workers(tmp_path_factory):
    """Return the run of a name that two workers carried, none of whom was lost."""
    runs = tmp_path_factory.mktemp("two")

    def run_of(name):
        if not (runs / name).exists():
            train(ALIKE[name](runs / name), NullCallback(), lambda text: None, spread_here(2)[0])
        return runs / name

    return run_of


@pytest.mark.parametrize(
    ("name", "lost"),
    [("ppo", (0, 3, 4, 9)), ("ppo whose learner is beside", (3, 7)), ("cars", (1, 4)), ("snakes", (2, 7))],
)
def test_lost_workers_change_nothing(of_two_workers, tmp_path, name, lost):
    wild = tmp_path / "wild"
    spread, transport = spread_here(2, lost_at=lost)
    told = []
    train(ALIKE[name](wild), NullCallback(), told.append, spread)
    assert transport.ended == len(lost)
    assert sum("was lost" in line for line in told) == len(lost)
    assert_same(of_two_workers(name), wild)


def test_lost_workers_of_a_learner_that_remembers_change_nothing(tmp_path):
    quiet, wild = tmp_path / "quiet", tmp_path / "wild"
    train(
        cart(quiet, "replay.learning_starts=64", algorithm="dqn"), NullCallback(), lambda text: None, spread_here(2)[0]
    )
    spread, transport = spread_here(2, lost_at=(2, 5, 8))
    train(cart(wild, "replay.learning_starts=64", algorithm="dqn"), NullCallback(), lambda text: None, spread)
    assert transport.ended == 3
    assert_same(quiet, wild)


def test_a_place_that_loses_every_worker_is_named(tmp_path):
    spread, transport = spread_here(1, lost_at=tuple(range(2, 2 + LOST_IN_A_ROW)))
    with pytest.raises(ClusterError, match=f"{LOST_IN_A_ROW} workers one after the other were lost in place 0"):
        train(cart(tmp_path / "run"), NullCallback(), lambda text: None, spread)
    assert transport.closed
    assert len(curve(tmp_path / "run")) == 2  # what was learned until then stands


def test_workers_that_never_come_are_named(tmp_path):
    spread, transport = spread_here(2, come_seconds=0.0, never_come=True)
    with pytest.raises(ClusterError, match="0 of 2 workers came, and for 0 s no other"):
        train(cart(tmp_path / "run"), NullCallback(), lambda text: None, spread)
    assert transport.closed
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("name", ["ppo", "ppo with a memory", "snakes", "cars"])
def test_a_run_of_workers_goes_on_to_the_same_curve(of_two_workers, tmp_path, name):
    whole, broken = of_two_workers(name), tmp_path / "broken"
    last = len(curve(whole))
    request = ALIKE[name](broken)
    train(
        type(request)(**{**vars(request), "stops": ("iterations=2",)}),
        NullCallback(),
        lambda text: None,
        spread_here(2)[0],
    )
    told = []
    resume(broken, (f"iterations={last}",), NullCallback(), told.append, spread=spread_here(2)[0])
    assert "goes on after iteration 2" in told
    assert_same(whole, broken)


def test_a_run_moves_from_one_process_to_workers_and_back(tmp_path):
    run, told = tmp_path / "run", []
    train(snakes(run, "evaluation.every=1"), NullCallback(), told.append)
    resume(run, ("iterations=7",), NullCallback(), told.append, spread=spread_here(3)[0])
    resume(run, ("iterations=9",), NullCallback(), told.append, spread=spread_here(2)[0])
    resume(run, ("iterations=11",), NullCallback(), told.append)
    moves = [line for line in told if "goes on after" in line]
    assert [line.split(",")[0].split(";")[1] for line in moves] == [
        " its worlds were carried by one process and are by 3 now",
        " its worlds were carried by 3 workers and are by 2 now",
        " its worlds were carried by workers",
    ]
    steps = [row["steps"] for row in curve(run)]
    assert [row["iteration"] for row in curve(run)] == list(range(1, 12))
    assert all(later > earlier for earlier, later in zip(steps, steps[1:], strict=False))


def test_ticks_of_all_workers_stand_in_the_episode_files(tmp_path):
    import polars

    train(cars(tmp_path / "run"), NullCallback(), lambda text: None, spread_here(2)[0])
    ticks = polars.read_parquet(tmp_path / "run" / "episodes" / "2.parquet")
    assert len(ticks) == 4 * 16
    assert sorted(ticks["world"].unique()) == [0, 1, 2, 3]
    assert ticks["iteration"].unique().to_list() == [2]


def test_what_is_waited_for_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr(worker_pool, "TELL_SECONDS", 0.0)
    said, spread = [], spread_here(2, slow_to="open")[0]
    train(cart(tmp_path / "run", stops="iterations=1"), NullCallback(), said.append, spread)
    assert said[0] == "- cluster 2: waiting for its workers"
    assert re.fullmatch(r"- cluster: after \d+ s [01] of 2 workers have opened their worlds", said[1])


def test_more_workers_than_worlds_are_not_asked(tmp_path):
    spread, transport = spread_here(6)
    told = []
    train(cart(tmp_path / "run"), NullCallback(), told.append, spread)
    assert any("6 workers, and rollout.num_worlds is 4" in line for line in told)
    assert transport.asked.count("open") == 4
    job = json.loads((tmp_path / "run" / "job.json").read_text())
    assert job["cluster"] == {"asked": "6", "workers": 4, "machines": 1}


def test_what_cannot_be_spread_is_named_before_anything_is_begun(tmp_path):
    spread, transport = spread_here(2)
    with pytest.raises(SettingError, match="es deals a member of its population"):
        train(cart(tmp_path / "run", algorithm="es"), NullCallback(), lambda text: None, spread)
    with pytest.raises(SettingError, match="fidelity aws"):
        train(RaceRequest(run=tmp_path / "run", preset="aws"), NullCallback(), lambda text: None, spread)
    assert not transport.asked
    assert not (tmp_path / "run").exists()


def test_a_reward_function_that_fails_in_a_worker_is_the_users_letter(tmp_path):
    (tmp_path / "car").mkdir()
    (tmp_path / "car" / "reward_function.py").write_text(
        "def reward_function(params):\n    if params['steps'] > 5:\n        return 1 / 0\n    return 1.0\n"
    )
    request = RaceRequest(
        tmp_path / "car", run=tmp_path / "run", stops=("iterations=4",), overrides=(*SMALL[:4], SMALL[5])
    )
    with pytest.raises(UserInputError, match="ZeroDivisionError"):
        train(request, NullCallback(), lambda text: None, spread_here(2)[0])
