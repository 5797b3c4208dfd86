"""AWS's comparison made again, in seconds: every row trains, is judged, is kept; broken off, it goes on."""

import csv
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from tests.cli.conftest import racecraft  # noqa: F401 - the fixture

from racecraft.algorithms.registry import find_algorithm
from racecraft.contract.errors import SettingError
from racecraft.formats.reproduction import COLUMNS, read_table
from racecraft.jobs.reproduction.comparison import Asked, ComparisonError, compare
from racecraft.jobs.reproduction.rows import GYMS, require_rows, rows_for
from racecraft.worlds.battlesnake.env.source_experiment import StarterPackGames
from racecraft.worlds.battlesnake.evaluation.whole_games import RandomMoves, play_whole_games
from racecraft.worlds.gymnasium.training.trainer import GymRequest, plan

REPRODUCE = (sys.executable, "-m", "racecraft", "snakes", "reproduce", "aws")
QUICK = ("--minutes=0.05", "--games=3")


def run(*words, cwd, code=0):
    done = subprocess.run([*REPRODUCE, *words], cwd=cwd, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == code, done.stdout + done.stderr
    return done


@pytest.mark.parametrize("gym", list(GYMS))
@pytest.mark.parametrize("cores", [1, 2, 12])
def test_every_row_is_a_legal_training(gym, cores):
    rows = rows_for(gym, cores)
    assert [row.name for row in rows if row.is_ours] == ["ours"]
    assert ("apex-heterogeneous" in [row.name for row in rows]) == (cores > 1)
    for row in rows:
        planned = plan(GymRequest(row.world, algorithm=row.algorithm, overrides=row.settings))
        assert planned.settings.runtime.threads <= row.cores
        assert find_algorithm(row.algorithm).name == row.algorithm


def test_the_chart_rows_share_what_the_source_says_they_share():
    """Facts D.1: the same hyperparameters; B.3: those of the old trainer."""
    for row in rows_for("starter-pack", 4):
        if row.is_ours:
            continue
        settings = plan(GymRequest(row.world, algorithm=row.algorithm, overrides=row.settings)).settings
        own = getattr(settings, row.algorithm)
        assert (own.learning_rate, own.discount, own.batch_size, own.train_every) == (5e-4, 0.95, 64, 20)
        assert settings.replay.capacity == (5000 if row.name == "old" else 50_000)
        assert settings.network.stack_size == 2
        if row.name != "old":  # RLlib's own defaults, which count environment steps
            assert own.target_every * own.train_every == 500
            assert row.algorithm == "apex" or own.epsilon_steps == 10_000


def test_two_rows_leave_table_chart_and_page_and_asked_again_nothing_is_trained_twice(tmp_path):
    words = (*QUICK, "--row=old", "--row=dqn-1-core", "--run=made")
    told = json.loads(run(*words, "--json", cwd=tmp_path).stdout)
    assert [row["row"] for row in told["rows"]] == ["random", "masked-random", "old", "dqn-1-core"]
    with open(tmp_path / "made" / "table.csv", newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert tuple(lines[0]) == COLUMNS
    assert 0.0 < float(lines[-1]["processor_share"]) < 1.5
    assert lines[0]["processor_share"] == ""
    assert [one["row"] for one in told["best_over_old"]] == ["dqn-1-core", "masked-random"]
    assert told["best_over_old"] == json.loads((tmp_path / "made" / "table.json").read_text())["best_over_old"]
    asked, rows = read_table(tmp_path / "made" / "table.json")
    assert asked == {"gym": "starter-pack", "minutes": 0.05, "games": 3, "seed": 1}
    trained = {row.row: curve for row, curve in rows if row.minutes is not None}
    assert all(curve and curve[-1].minutes > 0.0 for curve in trained.values())
    assert (tmp_path / "made" / "chart.png").read_bytes()[:4] == b"\x89PNG"
    assert "apex" not in (tmp_path / "made" / "table.csv").read_text()
    page = (tmp_path / "made" / "page.html").read_text(encoding="utf-8")
    assert "racecraft gym train racecraft.worlds.battlesnake.env.source_experiment:StarterPackGames" in page
    metrics = {name: (tmp_path / "made" / name / "metrics.jsonl").stat().st_mtime_ns for name in ("old", "dqn-1-core")}
    again = run(*words, cwd=tmp_path)
    assert "best over old, the source's rows: dqn-1-core" in again.stdout
    assert {name: (tmp_path / "made" / name / "metrics.jsonl").stat().st_mtime_ns for name in metrics} == metrics


@pytest.mark.long
def test_broken_off_it_keeps_what_is_finished_and_goes_on_with_the_rest(tmp_path):
    words = ("--games=3", "--minutes=0.1", "--row=old", "--run=made")
    process = subprocess.Popen([*REPRODUCE, *words], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    metrics = tmp_path / "made" / "old" / "metrics.jsonl"
    _until(lambda: metrics.exists() and metrics.stat().st_size)
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=120)
    assert process.returncode == 130, said
    assert b"the same command goes on" in said
    reached = [json.loads(line)["seconds"] for line in metrics.read_text().splitlines()][-1]
    _, rows = read_table(tmp_path / "made" / "table.json")
    assert [row.row for row, _ in rows] == ["random", "masked-random"]
    run(*words, cwd=tmp_path)
    seconds = [json.loads(line)["seconds"] for line in metrics.read_text().splitlines()]
    assert seconds[0] <= reached < seconds[-1]
    assert seconds == sorted(seconds)


def _until(holds, seconds=120.0):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def test_another_comparison_in_the_same_folder_is_refused(tmp_path):
    compare(tmp_path, Asked("starter-pack", 1.0, 3, 1), [], print, lambda results: None)
    with pytest.raises(ComparisonError, match="a comparison of gym starter-pack, minutes 1.0"):
        compare(tmp_path, Asked("exact", 1.0, 3, 1), [], print, lambda results: None)


@pytest.mark.parametrize(
    ("words", "letter"),
    [
        (("--gym=exakt",), "Did you mean 'exact'"),
        (("--row=apex-homogenous",), "Did you mean 'apex-homogeneous'"),
        (("--minutes=0",), "expected 0.01 to 1440 minutes,"),
        (("--games=1",), "2 to 10,000 games"),
    ],
)
def test_what_cannot_be_compared_is_refused_before_anything_is_made(racecraft, tmp_path, words, letter):  # noqa: F811
    said = racecraft("snakes", "reproduce", "aws", *words, "--run=made")
    assert said.code == 2
    assert letter in " ".join(said.err.split())
    assert not (tmp_path / "made").exists()


def test_rows_are_named_in_the_charts_order():
    rows = rows_for("starter-pack", 2)
    assert [row.name for row in require_rows(rows, ["ours", "old"])] == ["old", "ours"]
    with pytest.raises(SettingError, match="expected one of starter-pack, exact"):
        rows_for("starterpack", 2)


def test_a_whole_game_is_counted_to_its_end_and_only_once():
    """By hand: the first game of each world, told by the world's own turn counter."""
    world, lengths, totals = StarterPackGames(20), {}, np.zeros(20)

    class Spy(RandomMoves):
        def act(self, observations, action_mask=None):
            turns = world.turns.copy()
            for game in np.flatnonzero(turns == 0):
                if game in started:
                    lengths.setdefault(int(game), last[game])
                started.add(int(game))
            last[:] = turns + 1
            return super().act(observations, action_mask)

    started, last = set(), np.zeros(20, int)
    figures = play_whole_games(Spy(1), world, 5)
    told = [lengths.get(game, last[game]) for game in range(20)]
    assert figures.length.tolist() == told
    assert totals.shape == figures.reward.shape
    assert figures.reward.min() >= -10.0


@pytest.mark.skipif(
    not hasattr(os, "sched_getaffinity") or len(os.sched_getaffinity(0)) < 2, reason="one core, or no Linux"
)
def test_a_learner_with_a_core_of_its_own_leaves_the_actors_the_others():
    import gc

    from racecraft.algorithms.building import build_learner
    from racecraft.settings.overrides import apply_overrides
    from racecraft.worlds.gymnasium.training.trainer import default_settings

    before = os.sched_getaffinity(0)
    apex = find_algorithm("apex")
    settings = apply_overrides(default_settings(apex), ("apex.learner_cores=1",))
    learner = build_learner(apex, StarterPackGames(1).spec, settings, 1)
    assert learner._beside.submit(os.sched_getaffinity, 0).result() == {max(before)}
    assert os.sched_getaffinity(0) == before - {max(before)}
    del learner
    gc.collect()
    assert os.sched_getaffinity(0) == before
    settings = apply_overrides(default_settings(apex), (f"apex.learner_cores={len(before)}",))
    with pytest.raises(SettingError, match="actors need one"):
        build_learner(apex, StarterPackGames(1).spec, settings, 1)
