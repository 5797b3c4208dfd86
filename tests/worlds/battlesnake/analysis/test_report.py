"""The page of a snake's run tells its rating."""

import json

from tests.page_reader import Reader

from racecraft.analysis.report import write_report
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder


def test_a_snakes_page_tells_its_rating_and_whom_it_beat(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "battlesnake", "title": "snakes: duel", "settings": {}})
    run.append_metrics({"iteration": 1, "steps": 10, "seconds": 0.5, "training_score": None})
    run.append_metrics({"iteration": 2, "steps": 20, "seconds": 1.0, "evaluation_score": 1606.94})
    against = {"hungry": {"games": 50, "won": 21}, "flood_fill": {"games": 50, "won": 15}}
    rating = {"rating": 1606.94, "rating_low": 1557.1, "rating_high": 1656.7, "against": against}
    (run.evaluations / "2.json").write_text(json.dumps(rating))
    Checkpoints(run.checkpoints).save(2, 20, {}, {}, score=1606.94, best=True)
    reader = Reader()
    reader.feed(write_report(run, tmp_path / "report.html").read_text(encoding="utf-8"))
    words = " ".join(" ".join(reader.words).split())
    for expected in (
        "snakes: duel",
        "1607 best checkpoint, rating",
        "rating (Elo)",
        "1557 to 1657",
        "won against hungry",
        "15 of 50",
    ):
        assert expected in words
    assert "sum of rewards" not in words


def test_a_run_that_was_not_judged_has_a_page_without_an_empty_chart(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "battlesnake", "settings": {}})
    run.append_metrics({"iteration": 1, "steps": 10, "seconds": 0.5, "entropy": 0.5})
    text = write_report(run, tmp_path / "report.html").read_text(encoding="utf-8")
    assert text.count("<rc-chart ") == 1, "the entropy alone"
