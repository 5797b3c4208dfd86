"""`racecraft telemetry` on a public log of AWS's, and on what is no log."""

import json
import re

import polars as pl
from tests.reference import TRACES

LOG = str(TRACES / "drfc-1-worker")


def test_a_public_log_goes_in_and_the_corner_to_work_on_comes_out(racecraft):
    said = racecraft("telemetry", LOG, "--json", "--csv", "laps.csv")
    assert said.code == 0, said.err
    facts = json.loads(said.out)
    assert (facts["track"], len(facts["laps"]), len(facts["corners"])) == ("reinvent_base", 45, 5)
    assert facts["lap"]["seconds"] == min(one["seconds"] for one in facts["laps"])
    named = re.match(r"Work on (turn \d \(\w+\)): it is worth (\d\.\d\d) s of the", facts["advice"])
    worst = max(facts["corners"], key=lambda one: one["lost_seconds"])
    assert (named[1], named[2]) == (worst["name"], f"{worst['lost_seconds']:.2f}")
    told = sum(one["lost_seconds"] for one in facts["corners"]) + facts["start_seconds"]
    assert abs(told - facts["lost_seconds"]) < 1e-3
    assert facts["sequences"][0]["count"] >= facts["sequences"][1]["count"] > 1
    table = pl.read_csv("laps.csv")
    turns = [f"turn_{k}_s" for k in range(1, 6)]
    assert table.height == 45
    assert (table.select(pl.sum_horizontal(turns)).to_series() - table["seconds"]).abs().max() < 1e-3


def test_a_lap_against_another_log_prints_tables(racecraft):
    said = racecraft("telemetry", LOG, "--phase", "evaluation", "--against", LOG)
    assert said.code == 0, said.err
    assert (
        "3 full laps; lap evaluation of 2022-07-09 20:02, episode 1 beside the fastest lap of drfc-1-worker" in said.out
    )
    assert "turn 5 (left)" in said.out


def test_a_lap_as_a_file_is_the_lap_again(racecraft):
    assert racecraft("telemetry", LOG, "--lap", "2", "--line", "lap.csv").code == 0
    said = racecraft("telemetry", LOG, "--lap", "2", "--against", "lap.csv", "--json")
    facts = json.loads(said.out)
    assert abs(facts["lost_seconds"]) < 0.02
    assert max(abs(one["lost_seconds"]) for one in facts["corners"]) < 0.05  # it ends 0.1 m beside where it began


def test_what_cannot_be_is_refused_by_name(racecraft):
    for options, words in (
        (("--lap", "99"), "expected 1 to 45"),
        (("--turn", "9=2"), "has 5 corners"),
        (("--reward-at", "900=1"), "--reward-at: reinvent_base has no waypoint 900"),
        (("--actions", "4,90"), "chooses action 90; expected some of 0, 1"),
        (("--phase", "evaluation", "--begins", "line", "--within", "0", "--clean", "--iterations", "90.."), "none of"),
    ):
        said = racecraft("telemetry", LOG, *options)
        assert (said.code, said.out) == (2, ""), options
        assert words in said.err


def test_a_log_without_a_full_lap_says_so(racecraft):
    said = racecraft("telemetry", str(TRACES / "droa-2026-discrete"))
    assert said.code == 2
    assert "none of the 40 episodes is a full lap" in said.err
