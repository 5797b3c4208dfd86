"""RUN[:which] in every command that takes a run, by one door."""

import json

import pytest
from tests.cli.conftest import TINY, typed
from tests.forked import Begun

from racecraft.actions.named_run import named_run
from racecraft.contract.errors import SettingError
from racecraft.formats.checkpoint import Checkpoints

WHOLE_RUN_ONLY = [["report"], ["train", "--resume", "--run"]]


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A run `r` whose best checkpoint is 1 and whose last is 2."""
    folder = tmp_path_factory.mktemp("named")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert typed("train", "--run", "r", "--no-pictures", "--stop", "iterations=2", *TINY) == 0
    Checkpoints(folder / "r/checkpoints").mark(1, 1.0, best=True)
    return folder


@pytest.fixture
def inside(racecraft, trained, monkeypatch):
    monkeypatch.chdir(trained)
    return racecraft


EXPORT = ["export", "RUN", "--to", "car", "--no-check", "--output", "made", "--json"]
LOOK = ["look", "RUN", "--film", "made.mp4", "--page", "made.html", "--json"]
EVALUATE = ["evaluate", "RUN", "--laps", "1", "--json"]


@pytest.mark.parametrize(
    ("command", "which", "number"),
    [
        (EXPORT, "", 1), (EXPORT, ":best", 1), (EXPORT, ":last", 2), (EXPORT, ":0", 0), (EXPORT, ":reward", 2),
        (LOOK, ":last", 2), (EVALUATE, ":last", 2),
    ],
    ids=lambda told: told[0] if isinstance(told, list) else None,
)  # fmt: skip
def test_a_command_takes_the_checkpoint_that_was_named(inside, command, which, number):
    said = inside(*(word.replace("RUN", f"r{which}") for word in command))
    assert said.code == 0, said.err
    assert json.loads(said.out)["checkpoint"] == number


def test_checkpoints_lists_the_one_that_was_named(inside):
    assert [one["iteration"] for one in json.loads(inside("checkpoints", "r:last", "--json").out)["checkpoints"]] == [2]
    assert len(json.loads(inside("checkpoints", "r", "--json").out)["checkpoints"]) > 1


def test_watch_begins_with_the_checkpoint_that_was_named(trained):
    with Begun(["watch", "r:best", "--port", "0", "--no-open", "--json"], trained) as served:
        assert json.loads(served.stdout.readline())["url"].endswith("#iteration=1")


@pytest.mark.parametrize("words", WHOLE_RUN_ONLY, ids=lambda words: words[0])
def test_what_is_about_the_whole_run_says_so(inside, words):
    said = inside(*words, "r:best")
    assert said.code == 2
    assert "r is a run, and nothing here is called 'best'; expected the run alone" in said.err


@pytest.mark.parametrize(
    "words", [["export", "--to", "car"], ["evaluate"], ["watch"], ["train", "--from"]], ids=lambda words: words[0]
)
def test_a_misspelled_checkpoint_is_named_with_what_there_is(inside, words):
    said = inside(*words, "r:bset")
    assert said.code == 2
    assert "nothing here is called 'bset'" in said.err
    assert "racecraft checkpoints r lists them" in said.err


def test_a_checkpoint_is_named_once(inside):
    said = inside("export", "r:last", "--checkpoint", "best", "--to", "car")
    assert said.code == 2
    assert "r:last and --checkpoint best were given" in said.err
    with pytest.raises(SettingError, match="expected one of them"):
        named_run("r:1", "2")
