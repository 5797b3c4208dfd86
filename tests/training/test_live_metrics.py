"""Live metrics: Prometheus text, under the names of DeepRacer for Cloud."""

import json
import re
from pathlib import Path

import pytest
from prometheus_client import generate_latest
from prometheus_client.parser import text_string_to_metric_families

from racecraft.formats.run_folder import RunFolder
from racecraft.training.callbacks import EndedAlike, EvaluationResult, IterationReport
from racecraft.training.live_metrics import BY_STATUS, HELP, LEARNER, LiveMetrics

BOARD = Path(__file__).resolve().parents[2] / "examples" / "grafana" / "racecraft.json"
LAPS = {"lap_complete": EndedAlike(2, 40.0, 100.0, 9.5), "off_track": EndedAlike(3, 4.0, 20.0, 2.25)}


def report(iteration=1, result=None, **changed):
    told = {
        "iteration": iteration, "steps": 2048 * iteration, "seconds": 2.5 * iteration, "steps_per_second": 800.0,
        "episodes": 4, "mean_reward": 12.5, "training_score": 31.25, "losses": {"entropy": 1.5, "value_loss": 0.25},
        "result": result, "is_best": result is not None,
    }  # fmt: skip
    return IterationReport(**{**told, **changed})


@pytest.fixture
def live():
    return LiveMetrics('my "car"')


def samples(text, model='my "car"'):
    """Return the values by name, or by name and labels where there are more than those of every figure."""
    values = {}
    for family in text_string_to_metric_families(text):
        for sample in family.samples:
            labels = dict(sample.labels)
            assert (labels.pop("model"), labels.pop("worker")) == (model, "0")
            key = (sample.name, *(labels[name] for name in sorted(labels))) if labels else sample.name
            assert key not in values
            values[key] = sample.value
    return values


def read(live):
    return samples(generate_latest(live.registry).decode())


def test_figures_are_told_as_the_training_goes(live):
    assert read(live) == {"racecraft_training_running": 0.0}
    live.begin("title", "laps", "progress %")
    live.iteration(report())
    told = read(live)
    assert told["racecraft_training_reward"] == 12.5
    assert told["racecraft_training_score"] == 31.25
    assert told["dr_sagemaker_epochs_entropy"] == told[LEARNER, "entropy"] == 1.5
    assert told["racecraft_training_running"] == 1.0
    assert "dr_eval_episodes_progress" not in told
    judged = EvaluationResult(100.0, False, figures={"best_lap_seconds": 8.25})
    live.iteration(report(2, judged, mean_reward=None))
    live.end("laps")
    told = read(live)
    assert (told["dr_eval_episodes_progress"], told["dr_eval_episodes_elapsed_time"]) == (100.0, 8250.0)
    assert (told["racecraft_episodes_total"], told["racecraft_best_iteration"]) == (8.0, 2.0)
    assert told["racecraft_training_reward"] == 12.5  # the latest that was told
    assert told["racecraft_training_running"] == 0.0


def test_episodes_are_told_by_phase_and_status_as_deepracer_for_cloud_tags_them(live, tmp_path):
    live.run_made(RunFolder.create(tmp_path / "run", {"kind": "deepracer"}).path)
    live.iteration(report(1, by_status=LAPS))
    told = read(live)
    assert told["dr_training_episodes_elapsed_time", "training", "Lap complete"] == 9500.0
    assert told["dr_training_episodes_elapsed_time", "training", "Off track"] == 2250.0
    assert told["dr_training_episodes_progress", "training", "Off track"] == 20.0
    assert told["dr_training_episodes_reward", "training", "Lap complete"] == 40.0
    judged = EvaluationResult(100.0, True, by_status={"lap_complete": EndedAlike(8, None, 100.0, 8.0)})
    live.iteration(report(2, judged, by_status={"off_track": EndedAlike(1, 1.0, 10.0, 1.0)}))
    live.iteration(report(2, judged, by_status={"off_track": EndedAlike(1, 1.0, 10.0, 1.0)}))  # told again at the end
    told = read(live)
    assert told["dr_training_episodes_elapsed_time", "evaluation", "Lap complete"] == 8000.0
    assert ("dr_training_episodes_reward", "evaluation", "Lap complete") not in told, "an evaluation pays nothing"
    assert ("dr_training_episodes_reward", "training", "Lap complete") not in told, "the latest iteration had none"
    assert told["racecraft_episodes_ended_total", "training", "Off track"] == 4.0
    assert told["racecraft_episodes_ended_total", "training", "Lap complete"] == 2.0


def test_every_name_is_explained_and_typed(live):
    live.iteration(report(1, EvaluationResult(1.0, False, figures={"best_lap_seconds": 1.0}), by_status=LAPS))
    text = generate_latest(live.registry).decode()
    for name in HELP:
        assert f"# HELP {name} " in text, name
        assert f"# TYPE {name} {'counter' if name.endswith('_total') else 'gauge'}\n" in text


def test_the_board_asks_for_names_that_are_served():
    board = json.loads(BOARD.read_text(encoding="utf-8"))
    asked = {re.match(r"\w+", target["expr"])[0] for panel in board["panels"] for target in panel["targets"]}
    assert asked <= {*HELP, LEARNER}
    assert {name for name in HELP if name.startswith("dr_training")} == {name for name in BY_STATUS if "dr_" in name}
    assert {name for name in HELP if name.startswith("dr_")} <= asked


def test_names_and_numbers_of_any_kind_are_served():
    model = 'a "car" \\ of\nmine'
    live = LiveMetrics(model)
    losses = {"entropy": 1.5, "lost": float("nan"), "far": float("-inf")}
    live.iteration(report(3, losses=losses, by_status={'odd "end"': EndedAlike(1, 1.0, None, None)}))
    told = samples(generate_latest(live.registry).decode(), model)
    assert told[LEARNER, "far"] == float("-inf")
    assert told[LEARNER, "lost"] != told[LEARNER, "lost"]
    assert told["dr_training_episodes_reward", "training", 'odd "end"'] == 1.0
