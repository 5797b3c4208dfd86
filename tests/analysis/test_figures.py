"""Pictures are written, show what they should, and bad input is answered in letters."""

import numpy as np
import pytest
from PIL import Image

from racecraft.analysis.figures import FigureError, draw_curves
from racecraft.analysis.metrics import METRICS, metrics_markdown
from racecraft.formats.atomic import OutputFileError


def metric_rows(count):
    """Return lines of metrics as a training writes them."""
    return [
        {
            "iteration": k,
            "steps": 2048 * k,
            "seconds": 0.7 * k,
            "training_score": 2.0 * k,
            "evaluation_score": 10.0 * k if k % 2 else None,
            "entropy": 2.3 - 0.05 * k,
        }
        for k in range(1, count + 1)
    ]


def test_curves_show_only_what_was_measured(tmp_path):
    figure = draw_curves(tmp_path / "curves.png", metric_rows(6), title="A run", score_name="progress (% of a lap)")
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles == ["progress (% of a lap)", "entropy of the policy (nat)"]
    training, evaluation = figure.axes[0].get_lines()
    assert evaluation.get_xydata() == pytest.approx(np.array([[0.7, 10.0], [2.1, 30.0], [3.5, 50.0]]))
    assert len(training.get_xdata()) == 6
    assert np.asarray(Image.open(tmp_path / "curves.png").convert("L")).std() > 5


@pytest.mark.parametrize("count", [1, 2])
def test_a_training_that_has_only_begun_can_be_drawn(tmp_path, count):
    draw_curves(tmp_path / "curves.svg", metric_rows(count))
    assert (tmp_path / "curves.svg").stat().st_size > 5000


def test_bad_input_is_answered_in_letters(tmp_path):
    with pytest.raises(FigureError, match="no metrics yet; expected at least one iteration"):
        draw_curves(tmp_path / "curves.png", [])
    with pytest.raises(FigureError, match="Line 2 of the metrics has no seconds"):
        draw_curves(tmp_path / "curves.png", [*metric_rows(1), {"steps": 3}])
    with pytest.raises(FigureError, match=r"written as \.png, \.svg or \.pdf; got '\.bmp'"):
        draw_curves(tmp_path / "curves.bmp", metric_rows(1))
    with pytest.raises(OutputFileError, match="folder does not exist"):
        draw_curves(tmp_path / "nowhere" / "curves.png", metric_rows(1))
    assert list(tmp_path.iterdir()) == []


def test_every_name_a_training_writes_is_explained():
    """`metrics_row` writes the named figures, the learner's losses and the phases' seconds."""
    from racecraft.algorithms.ppo import FIGURES
    from racecraft.training.callbacks import EvaluationResult, IterationReport
    from racecraft.training.run_writer import metrics_row

    losses = dict.fromkeys(FIGURES, 0.0)
    phases = dict.fromkeys(("collect", "learn", "judge", "keep_before"), 0.0)
    judged = EvaluationResult(1.0, False, figures={"best_lap_seconds": 1.0})
    report = IterationReport(1, 1, 1.0, 1.0, 1, 0.0, 0.0, losses, judged, True, phases)
    assert [name for name in metrics_row(report) if name not in METRICS] == []
    assert all(meaning.endswith(".") for meaning in METRICS.values())
    assert metrics_markdown().count("\n") == len(METRICS) + 2
