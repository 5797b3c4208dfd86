"""A run of any kind says in its job.json on what it was trained: machine, threads, versions."""

import os
import platform
from importlib.metadata import version

import pytest
import torch

from racecraft.contract.kinds import kind_names
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.training import evaluator
from racecraft.worlds.battlesnake.training.trainer import SnakeRequest
from racecraft.worlds.deepracer.training.plan import RaceRequest
from racecraft.worlds.gymnasium.training.trainer import GymRequest

NET = ("network.hidden_units=8", "rollout.num_worlds=2", "rollout.horizon=8", "evaluation.episodes=2")
EYE = ("camera.width=16", "camera.height=12", "network.conv_filters=4", "network.conv_kernels=4",
       "network.conv_strides=2", "race.max_episode_seconds=1")  # fmt: skip


def unity_request(**words):
    pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")
    from racecraft.worlds.unity.training.plan import UnityRequest

    return UnityRequest(build="builtin:Basic", **words)


REQUESTS = {
    "deepracer": lambda **words: RaceRequest(overrides=(*NET, *EYE, *words.pop("threads")), **words),
    "gymnasium": lambda **words: GymRequest("CartPole-v1", overrides=(*NET, *words.pop("threads")), **words),
    "battlesnake": lambda **words: SnakeRequest(
        GameSettings(7, 7, 2),
        overrides=(*NET, "network.image_units=8", "snake.max_turns=20", *words.pop("threads")),
        **words,
    ),
    "unity": lambda **words: unity_request(overrides=(*NET[0:1], *NET[3:], *words.pop("threads")), **words),
}


def test_every_kind_is_tried():
    assert set(REQUESTS) == set(kind_names())


@pytest.mark.parametrize("kind", REQUESTS)
def test_a_run_records_what_it_was_trained_on(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(evaluator, "GAMES_AMONG_ANCHORS", 1)  # what the rating is worth is no matter here
    torch.set_num_threads(2)
    request = REQUESTS[kind](threads=("runtime.threads=1",), stops=("iterations=1",), run=tmp_path / "run", seed=5)
    job = train(request, NullCallback(), lambda _: None).run.read_job()
    assert job["kind"] == kind
    assert job["seed"] == 5
    assert job["threads"] == 1, "those it ran with, not those there were"
    assert job["machine"] == {
        "system": platform.system(), "processor": platform.machine(), "cores": os.cpu_count(),
    }  # fmt: skip
    known = {name: version(name) for name in ("torch", "numba", "numpy", "racecraft")}
    assert job["versions"] == {**known, "python": platform.python_version()}
    assert job["asked"]["stops"] == ["iterations=1"]


def test_only_groups_that_have_a_say_stand_in_a_cars_job(tmp_path):
    request = REQUESTS["deepracer"](threads=("runtime.threads=1",), stops=("iterations=1",), run=tmp_path / "run")
    job = train(request, NullCallback(), lambda _: None).run.read_job()
    assert set(job["settings"]) == {
        "race", "variation", "camera", "rollout", "network", "ppo", "curiosity", "rnd", "gail", "imitation",
        "evaluation", "runtime",
    }  # fmt: skip
    again = resume(tmp_path / "run", ("iterations=2",), NullCallback(), lambda _: None)
    assert again.run.read_job()["machine"] == job["machine"]
