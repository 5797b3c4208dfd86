"""What a run is judged by: words that fit its kind, how long is played, and what it came to, by hand."""

from types import SimpleNamespace

import pytest

from racecraft.contract.errors import SettingError
from racecraft.contract.kinds import MissingWorldError
from racecraft.contract.world import EpisodeRecord
from racecraft.evaluation.evaluate_run import evaluate_run, judge_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.rollout.episodes import CUT

CAR_WORDS, WORDS = ("track", "tracks", "laps"), ("episodes", "seed")
KINDS = {"deepracer": CAR_WORDS, "gymnasium": WORDS, "battlesnake": WORDS, "unity": WORDS}
JUDGES = {
    "deepracer": "racecraft.worlds.deepracer.evaluation.judged_run.judge_car",
    "gymnasium": "racecraft.evaluation.evaluate_run._evaluate",
    "battlesnake": "racecraft.worlds.battlesnake.evaluation.judged_run.judge_snake",
    "unity": "racecraft.worlds.unity.evaluation.judge_unity",
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_is_judged_by_the_words_of_its_kind_and_no_others(tmp_path, monkeypatch, kind):
    run = RunFolder.create(tmp_path / "run", {"kind": kind})
    monkeypatch.setattr(JUDGES[kind], lambda folder, which, **words: {"which": which, **words})
    told = dict.fromkeys(KINDS[kind], 1)
    assert evaluate_run(run.path, **told) == {"which": "best", **told}
    assert evaluate_run(f"{run.path}:last") == {"which": "last"}
    assert evaluate_run(f"{run.path}:last", "7") == {"which": "7"}
    for word in {*CAR_WORDS, *WORDS} - {*KINDS[kind]}:
        with pytest.raises(SettingError, match=f"a {kind} run is not judged by '{word}'"):
            evaluate_run(run.path, **{word: 1})


def test_a_kind_that_nobody_knows_is_named(tmp_path):
    RunFolder.create(tmp_path / "run", {"kind": "chess"})
    with pytest.raises(MissingWorldError, match=r"run: found the kind of world 'chess'"):
        evaluate_run(tmp_path / "run")


def episode(reward, steps, status="terminated"):
    return EpisodeRecord(0, 0, steps, reward, status)


@pytest.fixture
def played(monkeypatch):
    """Six episodes, whatever is played; `asked` is what was asked for."""
    asked = []
    records = [episode(1.0, 10), episode(2.0, 20, CUT), episode(6.0, 60, CUT), *[episode(99.0, 999, CUT)] * 3]
    play = "racecraft.evaluation.evaluate_run.play_episodes"
    monkeypatch.setattr(play, lambda policy, world, **how: asked.append(how) or records)
    return asked


WORLD = SimpleNamespace(spec=SimpleNamespace(num_worlds=2, num_agents=2))


def test_episodes_that_count_are_summed_by_hand(played):
    told = judge_episodes(None, WORLD, 3, 5)
    assert told == {
        "episodes": 3, "mean_return": pytest.approx(3.0), "std_return": pytest.approx((14 / 3) ** 0.5),
        "mean_steps": pytest.approx(30.0), "cut": 2,
        "total_return": 9.0, "max_return": 6.0, "min_return": 1.0,
    }  # fmt: skip


@pytest.mark.parametrize(("episodes", "each"), [(1, 1), (4, 1), (5, 2), (8, 2), (9, 3)])
def test_four_agents_play_as_many_episodes_each_as_it_takes(played, episodes, each):
    judge_episodes(None, WORLD, episodes, 5)
    judge_episodes(None, WORLD, episodes, 6, spare=1, most_steps=50)
    assert played == [
        {"episodes_each": each, "seed": 5, "spare": 0, "max_ticks": 100_000},
        {"episodes_each": each, "seed": 6, "spare": 1, "max_ticks": 50 * (each + 1)},
    ]
