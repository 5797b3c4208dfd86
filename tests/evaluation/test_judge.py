"""What a run is judged by: words that fit its kind, how long is played, and what it came to, by hand."""

import contextlib
import json
import os
from types import SimpleNamespace

import pytest

from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.contract.world import EpisodeRecord
from racecraft.evaluation import judge
from racecraft.evaluation.judge import judge_episodes, judge_run
from racecraft.evaluation.rating import Result, wilson
from racecraft.formats.run_folder import RunFolder
from racecraft.rollout.episodes import CUT

CAR_WORDS, WORDS = ("track", "tracks", "laps"), ("episodes", "seed")
KINDS = {"deepracer": CAR_WORDS, "gymnasium": WORDS, "battlesnake": WORDS, "unity": WORDS}
JUDGES = {
    "deepracer": "_judge_car",
    "gymnasium": "_judge_gymnasium",
    "battlesnake": "_judge_snake",
    "unity": "_judge_unity",
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_is_judged_by_the_words_of_its_kind_and_no_others(tmp_path, monkeypatch, kind):
    run = RunFolder.create(tmp_path / "run", {"kind": kind})
    monkeypatch.setattr(judge, JUDGES[kind], lambda folder, which, **words: {"which": which, **words})
    told = dict.fromkeys(KINDS[kind], 1)
    assert judge_run(run.path, **told) == {"which": "best", **told}
    assert judge_run(f"{run.path}:last") == {"which": "last"}
    assert judge_run(f"{run.path}:last", "7") == {"which": "7"}
    for word in {*CAR_WORDS, *WORDS} - {*KINDS[kind]}:
        with pytest.raises(SettingError, match=f"a {kind} run is not judged by '{word}'"):
            judge_run(run.path, **{word: 1})


def test_a_kind_that_nobody_knows_is_named(tmp_path):
    RunFolder.create(tmp_path / "run", {"kind": "chess"})
    with pytest.raises(RunFolderError, match="of an unknown kind, 'chess'"):
        judge_run(tmp_path / "run")


def episode(reward, steps, status="terminated"):
    return EpisodeRecord(0, 0, steps, reward, status)


@pytest.fixture
def played(monkeypatch):
    """Six episodes, whatever is played; `asked` is what was asked for."""
    asked = []
    records = [episode(1.0, 10), episode(2.0, 20, CUT), episode(6.0, 60, CUT), *[episode(99.0, 999, CUT)] * 3]
    monkeypatch.setattr(judge, "play_episodes", lambda policy, world, **how: asked.append(how) or records)
    return asked


WORLD = SimpleNamespace(spec=SimpleNamespace(num_worlds=2, num_agents=2))


def test_episodes_that_count_are_summed_by_hand(played):
    told = judge_episodes(None, WORLD, 3, 5)
    assert told == {
        "episodes": 3, "mean_return": pytest.approx(3.0), "std_return": pytest.approx((14 / 3) ** 0.5),
        "mean_steps": pytest.approx(30.0), "cut": 2,
    }  # fmt: skip


@pytest.mark.parametrize(("episodes", "each"), [(1, 1), (4, 1), (5, 2), (8, 2), (9, 3)])
def test_four_agents_play_as_many_episodes_each_as_it_takes(played, episodes, each):
    judge_episodes(None, WORLD, episodes, 5)
    judge_episodes(None, WORLD, episodes, 6, spare=1, most_steps=50)
    assert played == [
        {"episodes_each": each, "seed": 5, "spare": 0, "max_ticks": 100_000},
        {"episodes_each": each, "seed": 6, "spare": 1, "max_ticks": 50 * (each + 1)},
    ]


def test_patience_is_what_the_latest_evaluation_that_tells_it_had(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "unity"})
    assert judge._patience_of(run) is None
    for age, (name, text) in enumerate({
        "newest": "no json", "newer": "[3]", "none": '{"most_steps": 0}', "words": '{"most_steps": "9"}',
        "this": json.dumps({"most_steps": 1}), "older": '{"most_steps": 70}',
    }.items()):  # fmt: skip
        (run.evaluations / f"{name}.json").write_text(text)
        os.utime(run.evaluations / f"{name}.json", (1000 - age, 1000 - age))
    assert judge._patience_of(run) == 1
    (run.evaluations / "this.json").unlink()
    assert judge._patience_of(run) == 70


POLICY = SimpleNamespace(checkpoint=SimpleNamespace(iteration=12), metadata={"settings": "its settings"})


@pytest.mark.parametrize(
    ("words", "worlds", "episodes", "seed"),
    [({}, 20, 100, 1_000_000_007), ({"episodes": 20, "seed": 3}, 20, 20, 3), ({"episodes": 7}, 7, 7, 1_000_000_007)],
)
def test_an_environment_is_judged_by_a_hundred_episodes_in_twenty_copies(
    tmp_path, monkeypatch, words, worlds, episodes, seed
):
    from racecraft.worlds.gymnasium import evaluation as environments

    run = RunFolder.create(tmp_path / "run", {"kind": "gymnasium"})
    asked = []

    @contextlib.contextmanager
    def opened(run, num_worlds):
        asked.append(num_worlds)
        yield "a world"

    monkeypatch.setattr(judge, "load_policy", lambda run, which: asked.append(which) or POLICY)
    monkeypatch.setattr(environments, "opened_judging_world", opened)
    monkeypatch.setattr(judge, "judge_episodes", lambda *told: asked.append(told) or {"episodes": told[2]})
    told = judge_run(run.path, **words)
    assert asked == ["best", worlds, (POLICY, "a world", episodes, seed)]
    assert told == {"run": str(run.path), "checkpoint": 12, "episodes": episodes}


@pytest.mark.parametrize(("words", "games", "seed"), [({}, 50, 1_000_000_007), ({"episodes": 4, "seed": 3}, 4, 3)])
def test_a_snake_is_judged_against_every_anchor_and_shared_first_places_are_no_wins(
    tmp_path, monkeypatch, words, games, seed
):
    from racecraft.worlds.battlesnake.evaluation import batch
    from racecraft.worlds.battlesnake.players import trained
    from racecraft.worlds.battlesnake.players.anchors import ANCHORS

    run = RunFolder.create(tmp_path / "run", {"kind": "battlesnake", "asked": {"game": {"players": 3}}})
    asked = []
    places = [(0, 1, 2), (0, 0, 2), (1, 0, 2), (0, 1, 1)]

    def play(players, settings, count, seed):
        asked.append((players, settings.game.players, settings.view, settings.outlook, count, seed))
        return [Result((0, 1, 2), one) for one in places]

    monkeypatch.setattr(judge, "load_policy", lambda run, which: POLICY)
    monkeypatch.setattr(trained, "snake_config_in", lambda settings: SimpleNamespace(view=7, outlook=True))
    monkeypatch.setattr(batch, "play_batch", play)
    told = judge_run(run.path, **words)
    assert asked == [([POLICY, name, name], 3, 7, True, games, seed) for name in ANCHORS]
    low, high = wilson(2, 4)
    figures = {"games": 4, "won": 2, "won_share": 0.5, "won_share_low": low, "won_share_high": high}
    assert told == {"run": str(run.path), "checkpoint": 12, "against": dict.fromkeys(ANCHORS, figures)}


@pytest.mark.parametrize(
    ("words", "named", "laps"),
    [
        ({}, "its own", 3),
        ({"laps": 2}, "its own", 2),
        ({"track": "Oval_track"}, "Oval_track", 3),
    ],
)
def test_a_car_is_judged_by_three_laps_from_the_start_line_of_its_track(tmp_path, monkeypatch, words, named, laps):
    from racecraft.worlds.deepracer.evaluation import laps as of_laps
    from racecraft.worlds.deepracer.players import trained_car

    run = RunFolder.create(tmp_path / "run", {"kind": "deepracer"})
    asked = []
    own = SimpleNamespace(name="its own")
    car = SimpleNamespace(
        policy=POLICY, trained_on=own, world=lambda track, **how: asked.append((track.name, how)) or "a world"
    )
    monkeypatch.setattr(trained_car, "load_trained_car", lambda path, which: asked.append(which) or car)
    report = SimpleNamespace(as_dictionary=lambda: {"full_laps": 1})
    monkeypatch.setattr(of_laps, "judge_laps", lambda *told: asked.append(told) or report)
    told = judge_run(run.path, **words)
    assert asked == [
        "best", (named, {"num_cars": 1, "start_shares": [0.0], "laps": laps}), (POLICY, "a world", laps)
    ]  # fmt: skip
    assert told == {"run": str(run.path), "checkpoint": 12, "track": named, "full_laps": 1}


@pytest.mark.parametrize(("words", "starts"), [({"tracks": "a,b"}, 5), ({"tracks": ["a", "b"], "laps": 2}, 2)])
def test_on_several_tracks_a_car_drives_from_five_starts_each(tmp_path, monkeypatch, words, starts):
    from racecraft.worlds.deepracer.evaluation import by_track
    from racecraft.worlds.deepracer.players import trained_car

    run = RunFolder.create(tmp_path / "run", {"kind": "deepracer"})
    monkeypatch.setattr(trained_car, "load_trained_car", lambda path, which: "car")
    monkeypatch.setattr(by_track, "judge_named", lambda car, names, starts: (car, names, starts))
    monkeypatch.setattr(by_track, "told_of", lambda car, results, starts: {"told": results, "starts": starts})
    assert judge_run(run.path, **words) == {"told": ("car", ["a", "b"], starts), "starts": starts}
    with pytest.raises(SettingError, match="all names in one of them"):
        judge_run(run.path, track="c", **words)


@pytest.mark.parametrize(
    ("asked", "words", "made", "played"),
    [
        ({"behavior": "Basic", "build": "builtin:Basic"}, {}, ("Basic", False, 0, ("--agents", "20")), (20, 0)),
        ({"behavior": ["Basic"], "build": "builtin:Basic"}, {"episodes": 3, "seed": 4},
         ("Basic", False, 4, ("--agents", "3")), (3, 4)),
        ({"behavior": ["A", "B"], "build": "x.app"}, {}, (["A", "B"], True, 0, None), (20, 0)),
        ({"behavior": "A", "build": "builtin:Basic", "env_args": ["--many"]}, {},
         ("A", False, 0, ("--many",)), (20, 0)),
    ],
)  # fmt: skip
def test_a_scene_is_judged_by_twenty_episodes_as_it_was_trained(tmp_path, monkeypatch, asked, words, made, played):
    from racecraft.worlds.unity.env import builds, world

    run = RunFolder.create(tmp_path / "run", {"kind": "unity", "asked": asked})
    (run.evaluations / "1.json").write_text('{"most_steps": 70}')
    seen = []

    class Scene:
        def __init__(self, build, behavior, several, seed, args=None):
            seen.append((build, (behavior, several, seed, args)))

        def close(self):
            seen.append("closed")

    def judged(policy, world, episodes, seed, most_steps):
        seen.append((policy, episodes, seed, most_steps))
        return {"episodes": episodes}

    monkeypatch.setattr(builds, "find_build", lambda name: f"<{name}>")
    monkeypatch.setattr(world, "UnityWorld", Scene)
    monkeypatch.setattr(judge, "load_policy", lambda run, which: POLICY)
    monkeypatch.setattr(judge, "judge_episodes", judged)
    assert judge_run(run.path, **words) == {"run": str(run.path), "checkpoint": 12, "episodes": played[0]}
    assert seen == [(f"<{asked['build']}>", made), (POLICY, *played, 70), "closed"]
