"""`racecraft logs`: real and made-up logs on the terminal, on a page, as tables."""

import json

import polars as pl
from tests.worlds.deepracer.logs import makers

from racecraft.worlds.deepracer.analysis.logs import circuit, page
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track


def test_one_json_object_with_everything_damaged(racecraft, tmp_path):
    makers.drfc(tmp_path / "model")
    path = tmp_path / "model/training-simtrace/0-iteration.csv"
    path.write_text(path.read_text() + "1,2\n")
    said = racecraft("logs", "model", "--json", "--csv", "all.csv", "--parquet", "all.parquet")
    assert said.code == 0, said.err
    facts = json.loads(said.out)
    assert (facts["ticks"], facts["track"], facts["reversed"]) == (72, "reinvent_base", False)
    assert facts["damaged"] == [
        {"file": "model/training-simtrace/0-iteration.csv", "line": 38,
         "what": "2 values where 17 are expected; the row was passed over"}
    ]  # fmt: skip
    assert "0-iteration.csv:38: 2 values" in said.err
    assert facts["phases"][0]["episodes"] == 6
    assert pl.read_csv("all.csv").height == pl.read_parquet("all.parquet").height == 72
    assert pl.read_parquet_metadata("all.parquet")["format"] == "racecraft ticks"


def test_several_folders_are_rounds(racecraft, tmp_path):
    for name in ("one", "two"):
        makers.drfc(tmp_path / name)
    facts = json.loads(racecraft("logs", "one", "two", "--json").out)
    assert [(row["round"], row["episodes"]) for row in facts["phases"]] == [(1, 6), (2, 6)]


def test_models_in_one_folder_are_told_apart_each_with_its_track_and_advice(racecraft, tmp_path):
    """One never gets far, the other does: what is true of one is said of no other."""
    for name, track, share in (("ahead", "Oval_track", 0.8), ("stuck", "reinvent_base", 0.1)):
        for k in range(2):
            part = makers.iteration(range(20 * k, 20 * k + 20), share=share, track=load_track(track))
            makers.write(tmp_path / "all" / name / "training-simtrace" / f"{k}-iteration.csv", part)
    facts = json.loads(racecraft("logs", "all", "--json").out)
    assert [(one["model"], one["rounds"], one["track"]) for one in facts["models"]] == [
        ("ahead", [1], "Oval_track"), ("stuck", [2], "reinvent_base"),
    ]  # fmt: skip
    words = {one["model"]: one["found"] for one in facts["advice"] if one["found"].startswith("Mean progress")}
    assert "80 % in the last" in words["ahead"]
    assert "10 % in the last" in words["stuck"]
    said = racecraft("logs", "all")
    assert "of 2 models" in said.out
    assert said.out.index("ahead (round 1), on Oval_track:") < said.out.index("stuck (round 2), on reinvent_base:")


def write_metrics(model):
    """Write metrics of one episode into a model's folder."""
    row = {"metric_time": 2500, "start_time": 500, "completion_percentage": 50, "trial": 1, "episode": 1,
           "phase": "training", "episode_status": "Off track", "reward_score": 7}  # fmt: skip
    (model / "metrics").mkdir(parents=True)
    (model / "metrics" / "TrainingMetrics.json").write_text(json.dumps({"metrics": [row]}))


def test_each_model_of_a_folder_has_the_page_of_its_folder_alone(racecraft, tmp_path, monkeypatch):
    """To the byte what its folder gives by itself: no tick, metric or damage of the model beside it."""
    section = page._section
    monkeypatch.setattr(page, "_section", lambda title, ticks, made: section(title, ticks, made[:1]))
    for name, track in (("ahead", "Oval_track"), ("nested/stuck", "reinvent_base")):
        part = makers.iteration(range(3), share=0.5, track=load_track(track))
        makers.write(tmp_path / "all" / name / "training-simtrace" / "0-iteration.csv", part)
    write_metrics(tmp_path / "all" / "ahead")
    write_metrics(tmp_path / "all" / "z")
    with (tmp_path / "all" / "ahead" / "training-simtrace" / "0-iteration.csv").open("a") as log:
        log.write("1,2\n")
    said = racecraft("logs", "all", "--page", "logs.html")
    assert said.out.index("page: logs-ahead.html") < said.out.index("nested/stuck (round 2)")
    assert "add --page" not in said.err
    assert not (tmp_path / "logs.html").exists()
    assert "2 values where 17 are expected" in (tmp_path / "logs-ahead.html").read_text()
    assert racecraft("logs", "all/nested/stuck", "--page", "alone.html").code == 0
    together, alone = ((tmp_path / one).read_text() for one in ("logs-nested-stuck.html", "alone.html"))
    assert together.replace("nested/stuck", "stuck") == alone
    assert "What the metrics files say" not in alone
    assert "What the metrics files say" in (tmp_path / "logs-ahead.html").read_text()


def test_two_models_never_share_a_page(racecraft, tmp_path):
    for name in ("a-b", "a/b"):
        makers.write(tmp_path / "all" / name / "training-simtrace" / "0-iteration.csv", makers.iteration(range(20)))
    said = racecraft("logs", "all", "--page", "logs.html")
    assert (said.code, "two models would be written to logs-a-b.html" in said.err) == (2, True)
    assert not list(tmp_path.glob("*.html"))


def test_what_is_no_log_ends_with_a_letter(racecraft, tmp_path):
    said = racecraft("logs", "nowhere")
    assert (said.code, said.out) == (2, "")
    assert "nowhere: there is no such file or folder; expected a run folder" in said.err
    (tmp_path / "empty.csv").write_text("")
    said = racecraft("logs", "empty.csv")
    assert said.code == 2
    assert "the file is empty" in said.err
    makers.drfc(tmp_path / "model")
    said = racecraft("logs", "model", "--track", "reinvent_bas")
    assert said.code == 2
    assert "Did you mean 'reinvent_base'" in said.err


def test_metrics_alone_are_told(racecraft, tmp_path):
    row = {"metric_time": 2500, "start_time": 500, "completion_percentage": 100, "trial": 1, "episode": 1,
           "phase": "training", "episode_status": "Lap complete", "reward_score": 7}  # fmt: skip
    (tmp_path / "TrainingMetrics.json").write_text(json.dumps({"metrics": [row]}))
    said = racecraft("logs", "TrainingMetrics.json", "--page", "m.html")
    assert said.code == 0, said.err
    assert "Metrics only." in said.out
    assert "2.00 s" in said.out
    page = (tmp_path / "m.html").read_text()
    assert all(text in page for text in ("Reward: sum of the rewards by episode", "Fastest laps", "are not in them"))
    refused = racecraft("logs", "TrainingMetrics.json", "--page", "p.html", "--plots", "mine.py")
    assert (refused.code, "no row of a simulation trace" in refused.err) == (2, True)


def test_a_page_is_one_file_that_fetches_nothing_and_its_ticks_are_placed_once(racecraft, tmp_path, monkeypatch):
    """Of a million ticks it would take seconds each time that a part of the page asks where they lie."""
    placed, locate = [], Track.locate
    monkeypatch.setattr(circuit, "SAMPLE", 10)  # which circuit it is, is found by few
    monkeypatch.setattr(Track, "locate", lambda track, points: placed.append(len(points)) or locate(track, points))
    makers.drfc(tmp_path / "model", iterations=3)
    makers.write(
        tmp_path / "model/evaluation-20220709200242/evaluation-simtrace/0-iteration.csv", makers.lap_by_lap(2, 30)
    )
    said = racecraft("logs", "model", "--page", "page.html", "--json")
    assert said.code == 0, said.err
    facts = json.loads(said.out)
    assert facts["page"] == "page.html"
    assert placed.count(facts["ticks"]) == 1
    text = (tmp_path / "page.html").read_text()
    assert "http://" not in text.replace("http://www.w3.org", "")
    assert "https://" not in text.replace("https://matplotlib.org", "")
    assert 'src="data:' in text
    for heading in ("Choose episodes", "How it learned", "On the track", "What it chose", "What was paid"):
        assert f">{heading}</h2>" in text
    assert "evaluation 20220709200242" in text
