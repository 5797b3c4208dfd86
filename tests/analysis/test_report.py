"""The page of any run: what it tells without a word of its world's, and where a world's own parts stand."""

import json

import pytest
from tests.page_reader import words_of

from racecraft.analysis.figures import FigureError
from racecraft.analysis.page_part import EVALUATIONS, PagePart
from racecraft.analysis.report import write_report
from racecraft.analysis.run_facts import ReportError
from racecraft.contract.kinds import MissingWorldError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.pages import parts


def test_what_is_no_film_has_no_title_and_is_refused(tmp_path):
    from racecraft.analysis.video import VideoError, film_title, small_film

    (tmp_path / "lap.mp4").write_text("no film")
    assert (film_title(tmp_path / "lap.mp4"), film_title(tmp_path / "none.mp4")) == ("", "")
    with pytest.raises(VideoError, match=r"lap\.mp4: is no film"):
        small_film(tmp_path / "lap.mp4")


def test_a_run_without_episodes_evaluations_or_a_known_track_still_has_a_page(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "gymnasium", "settings": {}})
    run.append_metrics({"iteration": 1, "steps": 10, "seconds": 0.5, "training_score": -3.0})
    text = write_report(run, tmp_path / "report.html").read_text(encoding="utf-8")
    assert "return (sum of rewards)" in text
    assert "<img" not in text
    assert "h of simulation" not in text  # that is how a car is reckoned


def test_a_page_of_returns_names_what_counts_as_solved(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "gymnasium", "title": "CartPole-v1", "settings": {}})
    run.append_metrics({"iteration": 8, "steps": 10, "seconds": 0.5, "evaluation_score": 23.34})
    told = {"episodes": 20, "mean_return": 23.34, "std_return": 4.29, "mean_steps": 23.3, "threshold": 475.0}
    (run.evaluations / "8.json").write_text(json.dumps(told))
    Checkpoints(run.checkpoints).save(8, 10, {}, {}, score=23.34, best=True)
    words = words_of(write_report(run, tmp_path / "report.html"))
    for expected in ("CartPole-v1", "23.34 best checkpoint, mean return", "A mean of 475 counts as solved", "4.29"):
        assert expected in words


def test_cells_are_escaped_but_bars_are_drawn():
    drawn = parts.table(("a<b", ""), [("<i>", parts.Bar(0.5))], (0,))
    assert '<th scope="col" class="right">a&lt;b</th>' in drawn
    assert "&lt;i&gt;" in drawn
    assert '<rect width="50.0%"' in drawn


def test_what_cannot_be_told_is_refused(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "gymnasium", "settings": {}})
    with pytest.raises(FigureError, match="no metrics yet"):
        write_report(run, tmp_path / "report.html")
    (run.evaluations / "2.json").write_text("{")
    with pytest.raises(ReportError, match=r"2\.json: cannot be read .*expected an evaluation"):
        write_report(run, tmp_path / "report.html")
    run.write_job({"kind": "gimnasium"})
    with pytest.raises(MissingWorldError, match=r"run: found the kind of world 'gimnasium'"):
        write_report(run, tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()


def test_a_world_puts_its_parts_behind_the_core_s_own(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "gymnasium", "settings": {}})
    run.append_metrics({"iteration": 1, "steps": 10, "seconds": 0.5, "training_score": -3.0})
    told = [
        PagePart("Late & last", [parts.paragraph("one"), parts.paragraph("two")], EVALUATIONS),
        PagePart("Early", [parts.paragraph("zero")]),
    ]
    text = write_report(run, tmp_path / "report.html", of_world=lambda facts: told).read_text(encoding="utf-8")
    order = ("How it learned", "Early</h2>\n<p>zero</p>", "Late &amp; last</h2>\n<p>one</p>", "Small print")
    text = text[text.index("<section") :]  # behind the list of contents
    assert [text.index(one) for one in order] == sorted(text.index(one) for one in order)
