"""`racecraft why` and `racecraft leaderboards`: the whole way, over a run that learned nothing."""

import json

from tests.cli.conftest import TINY

RACES = """\
Arn,Name,LaunchTime,TrackArn,MinimumLaps,RaceType,TimingMethod
arn:a,One,1700000000000,x::track/reinvent_base,1,TIME_TRIAL,BEST_LAP_TIME
arn:b,Two,1710000000000,x::track/Austin,1,TIME_TRIAL,BEST_LAP_TIME
"""
TABLE = "Alias,Rank,RankingScore,BestLapTime\nsomebody,1,9000,9000\n"


def test_why_and_history(racecraft, tmp_path):
    said = racecraft("train", "--stop", "iterations=2", "--run", "run", "--no-pictures", *TINY)
    assert said.code == 0, said.err
    told = racecraft("why", "run", "--starts", "3", "--checkpoints", "2", "--json")
    assert told.code == 0, told.err
    facts = json.loads(told.out)
    assert facts["starts"] == 3
    assert facts["full_laps"] + facts["failures"] + facts["out_of_time"] == 3
    assert facts["failures"] == sum(place["failures"] for place in facts["places"])
    assert len(facts["learned"]["checkpoints"]) == 2
    assert facts["start_places"]["between"] > 0
    page = (tmp_path / "run" / "why.html").read_text()
    assert "Why it fails" in page
    assert "What it learned and forgot" in page
    plain = racecraft("why", "run", "--starts", "2", "--checkpoints", "0", "--track", "Oval_track", "--page", "o.html")
    assert plain.code == 0, plain.err
    assert "starts round the lap" in plain.out
    assert "trained to start" not in plain.out
    assert racecraft("why", "nowhere").code == 2

    report = racecraft("report", "run")
    assert report.code == 0, report.err
    text = (tmp_path / "run" / "report.html").read_text()
    assert "Why it fails" in text
    assert "racecraft why run" in text

    archive = tmp_path / "archive"
    for name in ("arn:a", "arn:b"):
        (archive / name).mkdir(parents=True)
        (archive / name / "FINAL.csv").write_text(TABLE)
    (archive / "leaderboards.csv").write_text(RACES)
    assert "somebody" in racecraft("leaderboards", "archive").out
    facts = json.loads(racecraft("leaderboards", "archive", "--run", "run", "--laps", "1", "--json").out)
    assert [race["name"] for race in facts["races"]] == ["One"]
    assert facts["races"][0]["winner_seconds"] == 9.0
    assert "other physics" in facts["note"]
    wrong = racecraft("leaderboards", "archive", "--track", "Oval")
    assert wrong.code == 2
    assert "no race on the track 'Oval'" in wrong.err
    assert racecraft("leaderboards", "run").code == 2


def test_metrics_are_served_for_other_trainings_and_not_for_jobs(racecraft):
    short = ("--stop", "iterations=1", "--set", "rollout.horizon=16", "--json")
    said = racecraft("gym", "train", "CartPole-v1", "--metrics-port", "0", *short)
    assert said.code == 0, said.err
    assert "metrics: http://127.0.0.1:" in said.err
    for words in (
        ("gym", "train", "CartPole-v1"),
        ("snakes", "train"),
        ("unity", "train", "builtin:Basic"),
        ("train",),
    ):
        told = racecraft(*words, "--metrics-port", "0", "--detach")
        assert told.code == 2, words
        assert "--detach lets it go" in told.err
    assert "65535" in racecraft("snakes", "train", "--metrics-port", "70000").err
