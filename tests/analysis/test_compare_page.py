"""The page of a comparison: its verdict, its curves by seed, its dots, what differs."""

import math

import pytest

from racecraft.analysis.compare_page import Compared, compare_data, write_compare_page
from racecraft.evaluation.fresh_starts import FreshScores
from racecraft.evaluation.run_groups import differences, group_runs
from racecraft.evaluation.verdict import ScoredGroup, verdict_of
from racecraft.formats.run_folder import RunFolder


def run_of(path, rate, laps):
    """Make a run whose evaluations came to these best laps; None: no lap."""
    run = RunFolder.create(path, {"kind": "deepracer", "settings": {"ppo": {"learning_rate": rate}}})
    for iteration, lap in enumerate(laps, 1):
        run.append_metrics({"iteration": iteration, "steps": 1000 * iteration, "best_lap_seconds": lap})
    return str(path)


@pytest.fixture
def compared(tmp_path):
    """Three seeds that lap, and two of which the first does not."""
    fast = [run_of(tmp_path / f"fast-{k}", 1e-3, [9.0 + k, 7.0 + k]) for k in (1, 2, 3)]
    slow = [run_of(tmp_path / "slow-1", 1e-4, [None, None]), run_of(tmp_path / "slow-2", 1e-4, [20.0, 19.0])]
    groups = group_runs([*fast, *slow])
    scores = ((8.0, 8.5), (9.0, 9.5), (10.0, 10.5)), ((math.inf, 30.0), (19.0, 20.0))
    scored = [
        ScoredGroup(group.name, tuple(FreshScores("lap time, s", True, one, 2, 50.0) for one in seeds))
        for group, seeds in zip(groups, scores, strict=True)
    ]
    differing = differences(groups)
    return Compared(groups, scored, verdict_of(scored, differing), differing)


def test_a_curve_has_its_own_seeds_name_where_another_has_no_lap(compared):
    series = {one["name"]: one for one in compare_data(compared)["curves"]["plot"]["series"]}
    assert "slow-1" not in series
    assert series["slow-2"]["y"] == [20.0, 19.0]
    median = series["fast-1, fast-2, fast-3: median"]
    assert (median["y"][0], median["y"][-1]) == (11.0, 9.0)


def test_every_start_that_finished_is_a_dot(compared):
    rows = compare_data(compared)["dots"]["rows"]
    assert [len(row["dots"]) for row in rows] == [6, 3]
    assert rows[0]["dots"][0][0] < rows[0]["median"] < rows[1]["median"]


def test_the_page_is_one_file_with_the_verdict_first(compared, tmp_path):
    write_compare_page(tmp_path / "page.html", compared)
    html = (tmp_path / "page.html").read_text()
    assert html.index("No verdict. fast-1, fast-2, fast-3 looks better") < html.index("learning_rate")
    assert "https://" not in html.replace("https://github.com/leeoniya/uPlot", "")
    assert "<td>0.001</td>" in html
