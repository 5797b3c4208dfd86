"""`racecraft evaluate` with a race's options, as a user types them."""

import json

import pytest
from tests.cli.conftest import TINY

from racecraft.worlds.deepracer.evaluation.mishap_rules import MISHAPS
from racecraft.worlds.deepracer.evaluation.trial_race import TrialRaceRules


def test_a_race_is_judged_filmed_and_written_for_aws(racecraft, run, tmp_path):
    options = ("--number-of-trials", 2, "--max-resets", 1, "--off-track-penalty", 1)
    film = ("--video", "race.mp4", "--view", "pip", "--size", "480p", "--fps", 15, "--save-mp4")
    said = racecraft("evaluate", "r", "--checkpoint", "last", *options, *film, "--json")
    assert said.code == 0, said.err
    told = json.loads(said.out)
    assert told["trials"][-1]["status"] in ("off_track", "time_up", "immobilized", "reversed")
    assert told["resets"] <= 1
    assert (tmp_path / "race.mp4").is_file()
    assert (tmp_path / "race-strip.png").is_file()
    for folder in ("camera-pip", "camera-45degree", "camera-topview"):
        assert (tmp_path / "r" / "mp4" / folder / "1-video.mp4").is_file()
    metrics = json.loads((tmp_path / "r" / "metrics" / "evaluation" / f"{told['aws_files']}.json").read_text())
    ended = [one["status"] in MISHAPS.values() for one in told["trials"]]
    resets = [one["reset_count"] + last for one, last in zip(told["trials"], ended, strict=True)]
    assert [row["reset_count"] for row in metrics["metrics"]] == resets, "AWS counts the mishap that ended it, too"


WRONG = {
    "--number-of-trials is 0; expected 1 to 1000": ["--number-of-trials", "0"],
    "--laps and a race's own options": ["--laps", "2", "--max-resets", "1"],
    "no film size '8k'": ["--video", "a.mp4", "--view", "top", "--size", "8k"],
    "--view pip films nothing": ["--view", "pip"],
    "--size 720p has no say in the view dashboard": ["--video", "a.mp4", "--size", "720p"],
}


def test_what_cannot_be_judged_is_named(racecraft, run):
    for words, options in WRONG.items():
        said = racecraft("evaluate", "r", *options)
        assert (said.code, words in said.err) == (2, True), said


@pytest.fixture
def judged(monkeypatch):
    """Keep the rules by which races are judged, and the direction they are driven in; nobody drives."""
    kept = []

    class EnoughError(Exception):
        pass

    def keep(car, circuit, rules, reverse):
        kept.append((rules, reverse))
        raise EnoughError

    monkeypatch.setattr("racecraft.worlds.deepracer.actions.evaluate.race_car", keep)

    def run(racecraft, *words):
        with pytest.raises(EnoughError):
            racecraft(*words)
        return kept.pop()

    return run


def test_run_env_rules_the_race_and_the_command_line_outweighs_it(racecraft, tmp_path, judged):
    (tmp_path / "car").mkdir()
    (tmp_path / "car" / "run.env").write_text(
        "DR_EVAL_NUMBER_OF_TRIALS=4\nDR_EVAL_IS_CONTINUOUS=False\nDR_EVAL_MAX_RESETS=7\n"
        "DR_EVAL_OFF_TRACK_PENALTY=2.5\nDR_EVAL_COLLISION_PENALTY=9\nDR_EVAL_RESET_BEHIND_DIST=0.5\n"
        "DR_EVAL_REVERSE_DIRECTION=True\n"
    )
    trained = racecraft("train", "car", "--run", "r", "--no-pictures", "--stop", "iterations=1", *TINY)
    assert trained.code == 0, trained.err
    rules, reverse = judged(racecraft, "evaluate", "r", "--checkpoint", "last")
    assert (rules, reverse) == (
        TrialRaceRules(4, False, 0.5, max_resets=7, off_track_penalty=2.5, collision_penalty=9.0),
        True,
    )
    typed = (
        "--is-continuous", "--max-resets=2", "--off-track-penalty=1", "--collision-penalty=4",
        "--reset-behind-dist=2", "--no-reverse-direction",
    )  # fmt: skip
    rules, reverse = judged(racecraft, "evaluate", "r", "--checkpoint", "last", "--number-of-trials", 1, *typed)
    assert (rules, reverse) == (
        TrialRaceRules(1, True, 2.0, max_resets=2, off_track_penalty=1.0, collision_penalty=4.0),
        False,
    )
    plain = racecraft("evaluate", "r", "--checkpoint", "last", "--laps", 1, "--json")
    assert len(json.loads(plain.out)["laps"]) == 1, "--laps asks for laps, whatever run.env says"


def test_a_dr_evaluation_is_a_race_by_the_template_s_rules(racecraft, tmp_path, judged, run):
    (tmp_path / "run.env").write_text("DR_EVAL_MAX_RESETS=1\n")
    assert judged(racecraft, "dr", "run-evaluation", "r") == (TrialRaceRules(max_resets=1), False)
    (tmp_path / "run.env").write_text("DR_EVAL_REVERSE_DIRECTION=True\nDR_EVAL_IS_CONTINUOUS=0\n")
    assert judged(racecraft, "dr", "run-evaluation", "r") == (TrialRaceRules(is_continuous=False), True)


def test_a_penalty_of_run_env_is_waited(racecraft, tmp_path):
    """One mishap is forgiven: it costs what run.env says, or five seconds as at DeepRacer for Cloud."""
    (tmp_path / "car").mkdir()
    (tmp_path / "car" / "run.env").write_text("DR_EVAL_NUMBER_OF_TRIALS=1\nDR_EVAL_MAX_RESETS=1\n")
    time_enough = (*TINY, "--set", "race.max_episode_seconds=60")
    said = racecraft("train", "car", "--run", "r", "--no-pictures", "--stop", "iterations=1", *time_enough)
    assert said.code == 0, said.err
    for seconds, more in ((5.0, {}), (2.0, {"off_track_penalty": 2.0})):
        job = json.loads((tmp_path / "r" / "job.json").read_text())
        (tmp_path / "r" / "job.json").write_text(json.dumps({**job, "evaluate": {**job["evaluate"], **more}}))
        (trial,) = json.loads(racecraft("evaluate", "r", "--checkpoint", "last", "--json").out)["trials"]
        assert (trial["off_track_count"], trial["penalty_seconds"]) == (2, seconds), "the second one ends it"
