"""`racecraft snakes train`: one object, letters for bad input, the next word to type."""

import json

import pytest

TINY = (
    "--size", "7", "--snakes", "2", "--set", "rollout.num_worlds=8", "--set", "rollout.horizon=8",
    "--set", "network.image_units=8", "--set", "network.hidden_units=8", "--set", "ppo.batch_size=64",
    "--set", "evaluation.every=2", "--set", "evaluation.episodes=4", "--set", "snake.max_turns=40",
    "--set", "runtime.threads=1", "--stop", "iterations=2",
)  # fmt: skip


def test_one_object_and_then_a_resume(racecraft):
    said = racecraft("snakes", "train", *TINY, "--run", "r", "--json")
    assert said.code == 0, said.err
    told = json.loads(said.out)
    assert told["iterations"] == 2
    assert told["game"]["players"] == 2
    assert "solved" not in told
    assert told["evaluation"]["rating_low"] < told["evaluation"]["rating"]
    assert "evaluation rating" in said.err
    on = racecraft("snakes", "train", "--run", "r", "--resume", "--stop", "iterations=3", "--no-pictures")
    assert on.code == 0
    assert "goes on after iteration 2" in on.out
    assert "iteration 3" in on.out
    other = racecraft("snakes", "train", "--run", "r", "--resume", "--map", "empty")
    assert other.code == 2
    assert "--map cannot change" in other.err


def test_people_are_told_what_to_type_next(racecraft):
    said = racecraft("snakes", "train", *TINY, "--run", "r", "--no-pictures")
    assert "against flood_fill" in said.out
    assert "next: racecraft snakes play --url r --url flood_fill --view -W 7 -H 7" in said.out
    played = racecraft("snakes", "play", "--url", "r", "--url", "r:0", "-W", "7", "-H", "7", "--seed", "1")
    assert played.code == 0, played.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--snakes", "1"], "--snakes is 1; expected at least 2"),
        (["--stop", "ratin=3"], "Did you mean 'rating'"),
        (["--set", "selfplay.view=7"], "Did you mean 'snake.view'"),
        (["--stop", "laps"], "can never hold here; expected rating"),
        (["--set", "rollout.episodes_per_iteration=64"], "episodes_per_iteration"),
    ],
)
def test_bad_input_gets_a_letter(racecraft, words, said):
    answer = racecraft("snakes", "train", *words)
    assert answer.code == 2
    assert said in answer.err
