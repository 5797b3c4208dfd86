"""What pages show as printed is printed: every line has the shape of one that the program prints, figures aside."""

import re
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from tests.cli.conftest import TINY, racecraft  # noqa: F401 (a fixture)

from racecraft.training.callbacks import EvaluationResult, IterationReport
from racecraft.training.progress import LineWatcher
from racecraft.worlds.deepracer.cli.train import _say_what_came_of_it
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car

PAGE = Path(__file__).resolve().parents[2] / "docs" / "racing" / "getting_started.md"
SAMPLES = re.findall(r"^```text\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def shape(line):
    """A line without its figures: digits are one mark, gaps are one space."""
    return re.sub(r"\s+", " ", re.sub(r"-?\d[\d,]*(\.\d+)?", "#", line)).strip()


@pytest.fixture
def printed(racecraft, capsys, monkeypatch, tmp_path):  # noqa: F811
    """Shapes of all that a training, its end and an evaluation print."""
    long_enough = ("--set", "rollout.horizon=40")  # for episodes to end in the first iteration
    words = ("--stop", "iterations=1", "--no-pictures", "--run", "runs/reinvent_base-1", *TINY, *long_enough)
    said = racecraft("train", *words)
    assert said.code == 0, said.err
    judged = racecraft("evaluate", "runs/reinvent_base-1", "--laps", "1", "--video", "lap.mp4")
    assert judged.code == 0, judged.err
    lines = [*said.out.splitlines(), *judged.out.splitlines(), *plan_car(RaceRequest()).notes]
    files = {kind: f"runs/reinvent_base-1/{name}" for kind, name in FILES.items()}
    for stable, lap in ((21.5, 20.8), (None, 20.8), (None, None)):
        figures = {"seconds_to_stable_laps": stable, "best_lap_seconds": lap}
        run = SimpleNamespace(
            path=Path("runs/reinvent_base-1"), read_job=lambda: {"asked": {}}, read_metrics=lambda: [{"seconds": 60.0}]
        )
        _say_what_came_of_it(SimpleNamespace(summary=lambda told=figures: told, run=run), files)
    headlines = ("best lap 20.80 s", "best lap 20.80 s | flying lap 19.80 s")
    results = [EvaluationResult(100.0, True, headline=headline) for headline in headlines]
    watcher = LineWatcher(sys.stdout)
    watcher.begin("re:Invent 2018, car v6, run runs/reinvent_base-1", "steps=200000", "progress %")
    for iteration, result in enumerate(results, 1):
        watcher.iteration(IterationReport(iteration, 2, 1.0, 2.0, 3, 4.5, 6.0, {}, result, True))
    watcher.end("steps=200000")
    lines += capsys.readouterr().out.splitlines()
    return {shape(line) for line in lines} | {shape(f"- {line}") for line in lines}


FILES = {"video": "lap.mp4", "picture": "path.png", "curves": "curves.png", "report": "report.html"}


def test_every_line_that_the_first_page_shows_is_printed(printed):
    shown = [line for sample in SAMPLES for line in sample.splitlines() if line.strip() and not line.startswith("$ ")]
    assert len(shown) > 20
    constant = {
        "Filming the best policy's lap …",  # of `paint_run`, after a training that is not --no-pictures
        "Filming # ticks …",  # on standard error
    }
    laps = {"# # # % lap complete", "fastest lap # s; best known lap # s; gap +# %"}  # who learned nothing drives none
    assert [line for line in shown if shape(line) not in printed | constant | laps] == []
