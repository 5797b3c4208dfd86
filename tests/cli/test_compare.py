"""`train --seeds` and `racecraft compare`, as they are typed."""

import json

import pytest
from tests.reference import TRACES


@pytest.mark.long
def test_seeds_are_trained_into_a_group_that_compare_takes(racecraft):
    train = ("gym", "train", "CartPole-v1", "--stop", "steps=2000", "--no-pictures", "--json")
    said = racecraft(*train, "--seeds", "2", "--seed", "5", "--run", "high")
    assert said.code == 0, said.err
    told = json.loads(said.out)
    assert told["runs"] == ["high/seed-5", "high/seed-6"]
    low = racecraft(*train, "--seeds", "2", "--set", "ppo.learning_rate=1e-6", "--run", "low")
    assert low.code == 0, low.err
    found = json.loads(racecraft("compare", "high", "low", "--json").out)
    assert [group["name"] for group in found["groups"]] == ["high", "low"]
    assert [one["name"] for one in found["differences"]] == ["ppo.learning_rate"]
    assert found["luck"] >= 1 / 6 - 1e-9
    assert not found["is_clear"]
    again = racecraft("gym", "train", "CartPole-v1", "--seeds", "2", "--run", "high")
    assert (again.code, "found a folder in use" in again.err) == (2, True)


def test_seeds_with_one_mirror_are_refused(racecraft):
    said = racecraft("gym", "train", "CartPole-v1", "--seeds", "2", "--mirror", "s3://models/one")
    assert said.code == 2
    assert "--mirror has one place for one run" in said.err


def test_what_is_no_run_is_named(racecraft):
    said = racecraft("compare", "nowhere")
    assert said.code == 2
    assert "nowhere: there is no such folder" in said.err
    said = racecraft("compare", str(TRACES / "drfc-1-worker"))
    assert (said.code, "Logs alone cannot be judged" in said.err) == (2, True)
