"""Every command as a user types it, at the smallest size."""

import json
import subprocess
import sys

import numpy as np
import pytest
from tests.cli.conftest import TINY

from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_lock import RunLock
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names


def test_train_evaluate_and_look(racecraft, tmp_path):
    said = racecraft("train", "--stop", "iterations=2", "--json", *TINY)
    assert said.code == 0, said.err
    lines = said.out.strip().splitlines()
    assert len(lines) == 1, "one JSON object on one line, everything else on standard error"
    summary = json.loads(lines[0])
    wanted = {
        "seconds_to_first_full_lap", "seconds_to_stable_laps", "env_steps", "iterations", "env_steps_per_second",
        "best_lap_seconds", "evaluation", "run", "seed", "versions",
    }  # fmt: skip
    assert wanted <= set(summary)
    assert (summary["iterations"], summary["env_steps"]) == (2, 2 * 4 * 16)
    assert summary["run"] == "runs/reinvent_base-1"
    for name in ("lap.mp4", "path.png", "curves.png", "report.html", "job.json", "metrics.jsonl", "log.txt"):
        assert (tmp_path / summary["run"] / name).stat().st_size > 0, name

    judged = racecraft("evaluate", summary["run"], "--laps", "2", "--video", "film.mp4", "--json")
    assert judged.code == 0, judged.err
    facts = json.loads(judged.out)
    assert len(facts["laps"]) == 2
    assert (tmp_path / "film.mp4").stat().st_size > 0
    other = racecraft("evaluate", summary["run"], "--track", "Oval_track", "--checkpoint", "0", "--laps", "1")
    assert other.code == 0, other.err
    assert "off track" in other.out or "truncated" in other.out


def test_a_racers_own_folder_trains_and_prints_into_the_log(racecraft, tmp_path):
    assert racecraft("new", "my-car").code == 0
    reward = tmp_path / "my-car" / "reward_function.py"
    reward.write_text(
        reward.read_text().replace("    metres =", '    print("hello from", params["steps"])\n    metres =', 1)
    )
    said = racecraft("train", "my-car", "--run", "r", "--stop", "iterations=1", "--no-pictures", *TINY)
    assert said.code == 0, said.err
    assert "hello from 2.0" in (tmp_path / "r" / "log.txt").read_text()
    assert "hello from" not in said.out
    assert (tmp_path / "r" / "reward_function.py").read_text() == reward.read_text()


def test_whole_episodes_are_shared_among_cars(racecraft, tmp_path):
    folder = tmp_path / "car"
    folder.mkdir()
    (folder / "hyperparameters.json").write_text('{"num_episodes_between_training": 6, "batch_size": 32}')
    said = racecraft("train", folder, "--run", "r", "--stop", "iterations=2", "--no-pictures", *TINY)
    assert said.code == 0, said.err
    assert "3 worlds, not 4, so that each plays 2 of 6 episodes" in said.out
    rows = [json.loads(line) for line in (tmp_path / "r" / "metrics.jsonl").read_text().splitlines()]
    assert len(rows) == 2
    assert all(row["episodes"] >= 6 for row in rows)


def test_a_run_that_was_killed_goes_on_as_if_it_never_stopped(racecraft, tmp_path):
    """One run of four iterations, and one that is stopped after two and resumed: the same curve, bit for bit."""
    racecraft("train", "--run", "whole", "--stop", "iterations=4", "--no-pictures", *TINY)
    racecraft("train", "--run", "broken", "--stop", "iterations=2", "--no-pictures", *TINY)
    said = racecraft("train", "--run", "broken", "--resume", "--stop", "iterations=4", "--no-pictures")
    assert said.code == 0, said.err
    assert "goes on after iteration 2" in said.out
    assert curve(tmp_path / "broken") == curve(tmp_path / "whole")


def test_a_run_that_nobody_trains_is_not_said_to_have_been_stopped_and_goes_on_when_resumed(racecraft, run, tmp_path):
    said = racecraft("stop", "r")
    assert (said.code, said.out.strip()) == (
        0, "r: no process of this machine trains there; one of another machine that writes there will stop",
    )  # fmt: skip
    assert racecraft("train", "--run", "r", "--resume", "--stop", "iterations=2", "--no-pictures").code == 0
    assert len(list((tmp_path / "r" / "evaluations").glob("*.json"))) == 2
    with RunLock(tmp_path / "r"):
        assert racecraft("stop", "r").out.startswith("r: stopping; what it has learned stays")
    assert racecraft("stop", "nowhere").code == 2


def test_a_clone_begins_with_the_weights_of_its_parent(racecraft, run):
    said = racecraft("train", "--from", "r:last", "--run", "child", "--stop", "iterations=1", "--no-pictures", *TINY)
    assert said.code == 0, said.err
    parent = racecraft("evaluate", "r", "--checkpoint", "last", "--laps", "1", "--json")
    child = racecraft("evaluate", "child", "--checkpoint", "0", "--laps", "1", "--json")
    assert json.loads(parent.out)["laps"] == json.loads(child.out)["laps"]
    refused = racecraft("train", "--from", "r", "--run", "x", *TINY, "--set", "network.hidden_units=16")
    assert refused.code == 2
    assert "hidden_units=8 (here 16)" in refused.err
    assert "Say --set network.hidden_units=8, or train afresh." in refused.err


def curve(run):
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    timed = ("seconds", "steps_per_second")
    return [{name: value for name, value in row.items() if not name.startswith(timed)} for row in rows]


def test_a_track_of_one_s_own_is_imported_listed_and_trained_on(racecraft, tmp_path, monkeypatch):
    monkeypatch.setenv("RACECRAFT_TRACKS", str(tmp_path / "library"))
    np.save(tmp_path / "measured.npy", load_track("Oval_track").rows)
    said = racecraft("tracks", "import", "measured.npy", "--name", "garage", "--json")
    assert json.loads(said.out)["tracks"][0]["name"] == "garage"
    (tmp_path / "measured.npy").unlink()
    assert json.loads(racecraft("tracks", "list", "--json").out)["tracks"][0]["tags"] == ["own"]
    assert json.loads(racecraft("tracks", "show", "garage", "--json").out)["waypoints"] == 101
    trained = racecraft("train", "--track", "garage", "--stop", "iterations=1", "--no-pictures", "--json", *TINY)
    assert json.loads(trained.out)["run"] == "runs/garage-1"
    assert racecraft("evaluate", "runs/garage-1", "--laps", "1", "--json").code == 0


def test_an_evaluation_does_what_run_env_asked_for_unless_told_otherwise(racecraft, tmp_path):
    (tmp_path / "car").mkdir()
    (tmp_path / "car" / "run.env").write_text(
        "DR_EVAL_NUMBER_OF_TRIALS=2\nDR_EVAL_CHECKPOINT=last\nDR_CAR_COLOR=Blue\n"
    )
    racecraft("train", "car", "--run", "r", "--stop", "iterations=2", "--no-pictures", *TINY)
    Checkpoints("r/checkpoints").mark(1, 1.0, best=True)
    asked = json.loads(racecraft("evaluate", "r", "--json").out)
    assert (len(asked["laps"]), asked["checkpoint"]) == (2, 2)
    told = json.loads(racecraft("evaluate", "r", "--laps", "1", "--checkpoint", "best", "--json").out)
    assert (len(told["laps"]), told["checkpoint"]) == (1, 1)
    assert json.loads((tmp_path / "r" / "job.json").read_text())["env"]["DR_CAR_COLOR"] == "Blue"


def test_a_damaged_track_of_one_s_own_hides_no_other(racecraft, tmp_path, monkeypatch):
    monkeypatch.setenv("RACECRAFT_TRACKS", str(tmp_path / "library"))
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "broken.npy").write_bytes(b"no table")
    said = racecraft("tracks", "list", "--json")
    assert said.code == 0
    assert len(json.loads(said.out)["tracks"]) == 127
    assert said.err.startswith("Left out: ")
    assert "broken.npy" in said.err


def test_tracks_of_one_name_are_not_imported_together(racecraft, tmp_path):
    said = racecraft("tracks", "import", "a/oval.npy", "b/Oval.npy")
    assert said.code == 2
    assert "one name" in said.err


def test_tracks_are_listed_and_shown(racecraft, tmp_path):
    listed = json.loads(racecraft("tracks", "list", "--json").out)["tracks"]
    assert "reinvent_base" in [track["name"] for track in listed]
    shown = json.loads(racecraft("tracks", "show", "reinvent_base", "--picture", "t.png", "--json").out)
    assert shown["length_m"] == pytest.approx(17.709, abs=2e-3)
    assert (tmp_path / "t.png").stat().st_size > 0
    assert "Oval_track" in racecraft("tracks", "list").out


def test_waypoints_are_shown_as_a_reward_counts_them(racecraft):
    """Of the 259 rows of Spain_track's file number 18 repeats the one before; rewards are handed 259."""
    shown = json.loads(racecraft("tracks", "show", "Spain_track", "--json").out)
    assert (shown["waypoints"], shown["repeated"]) == (259, [18])
    plain = json.loads(racecraft("tracks", "show", "reinvent_base", "--json").out)
    assert plain["waypoints"] == 119
    assert "repeated" not in plain


def test_every_track_takes_one_line_however_narrow_the_terminal(racecraft, monkeypatch, tmp_path):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("RACECRAFT_TRACKS", str(tmp_path / "library"))
    lines = racecraft("tracks", "list").out.rstrip().splitlines()
    assert len(lines) == 1 + 127
    assert all(name in line for name, line in zip(names(), lines[1:], strict=True))


def test_a_gymnasium_environment_trains_on_the_same_loop(racecraft, tmp_path):
    words = ("--stop", "iterations=2", "--set", "rollout.horizon=32", "--run", "r", "--json")
    said = racecraft("gym", "train", "CartPole-v1", *words)
    assert said.code == 0, said.err
    assert json.loads(said.out)["env_steps"] == 2 * 8 * 32
    assert (tmp_path / "r" / "report.html").is_file()
    on = racecraft("gym", "train", "--run", "r", "--resume", "--stop", "iterations=3", "--no-pictures", "--json")
    assert json.loads(on.out).keys() == json.loads(said.out).keys() - {"report"}


def test_help_answers_at_once_because_it_imports_little():
    """Half a second is promised; what it takes is what is imported for it."""
    code = (
        "import sys, runpy\nsys.argv = ['racecraft', '--help']\n"
        "try: runpy.run_module('racecraft', run_name='__main__')\n"
        "finally: print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "racecraft train" in done.stdout
    imported = done.stderr.split()
    assert len(imported) < 650, "350 of which are Python's, typer's and rich's; torch alone brings a thousand"
    ours = {name for name in imported if name.startswith("racecraft.")}
    layers = {
        name.split(".")[3 if name.startswith("racecraft.worlds.") and name.count(".") > 2 else 1] for name in ours
    }
    requests = {"training", "serving", "league", "console", "driving"}  # light modules there hold requests of commands
    assert layers - requests <= {
        "actions",
        "cli",
        "contract",
        "files",
        "formats",
        "kind",
        "settings",
        "worlds",
        "__main__",
    }, "a command imports what it needs when it runs"
