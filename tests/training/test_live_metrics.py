"""Live metrics: Prometheus text over HTTP, under the names of DeepRacer for Cloud."""

import json
import re
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from racecraft.training.callbacks import EvaluationResult, IterationReport
from racecraft.training.live_metrics import CONTENT_TYPE, HELP, LEARNER, LiveMetrics, LiveMetricsError

BOARD = Path(__file__).resolve().parents[2] / "examples" / "grafana" / "racecraft.json"
LINE = re.compile(r'^([a-z_]+)\{model="((?:[^"\\]|\\.)*)",worker="0"(?:,figure="([a-z_]+)")?\} (-?[0-9.e+-]+)$')


def report(iteration=1, result=None, **changed):
    told = {
        "iteration": iteration, "steps": 2048 * iteration, "seconds": 2.5 * iteration, "steps_per_second": 800.0,
        "episodes": 4, "mean_reward": 12.5, "training_score": 31.25, "losses": {"entropy": 1.5, "value_loss": 0.25},
        "result": result, "is_best": result is not None,
    }  # fmt: skip
    return IterationReport(**{**told, **changed})


@pytest.fixture
def live():
    made = LiveMetrics(0, 'my "car"')
    yield made
    made.close()


def read(live):
    with urllib.request.urlopen(live.address) as answer:
        assert answer.headers["Content-Type"] == CONTENT_TYPE
        lines = answer.read().decode().splitlines()
    values = {}
    for line in lines:
        if not line.startswith("#"):
            name, model, figure, value = LINE.match(line).groups()
            assert model == 'my \\"car\\"'
            values[name if figure is None else (name, figure)] = float(value)
    return values


def test_figures_are_served_as_the_training_goes(live):
    assert read(live) == {"racecraft_training_running": 0.0}
    live.begin("title", "laps", "progress %")
    live.iteration(report())
    told = read(live)
    assert told["dr_training_episodes_reward"] == 12.5
    assert told["dr_training_episodes_progress"] == 31.25
    assert told["dr_sagemaker_epochs_entropy"] == told[LEARNER, "entropy"] == 1.5
    assert told["racecraft_training_running"] == 1.0
    assert "dr_eval_episodes_progress" not in told
    judged = EvaluationResult(100.0, False, figures={"best_lap_seconds": 8.25})
    live.iteration(report(2, judged, mean_reward=None))
    live.end("laps")
    told = read(live)
    assert (told["dr_eval_episodes_progress"], told["dr_eval_episodes_elapsed_time"]) == (100.0, 8250.0)
    assert (told["racecraft_episodes_total"], told["racecraft_best_iteration"]) == (8.0, 2.0)
    assert told["dr_training_episodes_reward"] == 12.5  # the latest that was told
    assert told["racecraft_training_running"] == 0.0


def test_every_name_is_explained_and_typed(live):
    live.iteration(report(1, EvaluationResult(1.0, False, figures={"best_lap_seconds": 1.0})))
    text = live.text()
    for name in HELP:
        assert f"# HELP {name} " in text, name
        assert f"# TYPE {name} {'counter' if name.endswith('_total') else 'gauge'}\n" in text
    assert text.endswith("\n")


def test_another_path_says_where_to_look(live):
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(live.address.replace("/metrics", "/"))
    assert caught.value.code == 404
    assert b"/metrics" in caught.value.read()


def test_a_port_that_is_taken_or_none_is_refused(live):
    with pytest.raises(LiveMetricsError, match="Choose another"):
        LiveMetrics(live.port, "b")
    with pytest.raises(LiveMetricsError, match="expected 0 to 65535"):
        LiveMetrics(70000, "b")


def test_the_board_asks_for_names_that_are_served():
    board = json.loads(BOARD.read_text(encoding="utf-8"))
    asked = {re.match(r"\w+", target["expr"])[0] for panel in board["panels"] for target in panel["targets"]}
    assert asked <= {*HELP, LEARNER}
    assert {name for name in HELP if name.startswith("dr_")} <= asked
