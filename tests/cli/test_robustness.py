"""`racecraft evaluate --under` and `racecraft sensors --under`, as a user types them."""

import json

import pytest
from tests.cli.conftest import TINY

from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport
from racecraft.worlds.deepracer.evaluation.robustness import Bar


def test_what_survives_is_told_as_table_picture_and_figures(racecraft, run, tmp_path):
    under = ("evaluate", "r", "--checkpoint", "last", "--under", "strong", "--tries", 2)
    said = racecraft(*under, "--only", "glare", "--only", "latency", "--picture", "bars.png")
    assert said.code == 0, said.err
    for word in ("undisturbed", "glare", "latency", "all together", "95 % of laps"):
        assert word in said.out
    told = said.err.splitlines()
    assert "Driving 2 starts undisturbed, then under glare, latency, all together" in told[0], "before any drives"
    assert [line.rpartition(" (")[2] for line in told[1:5]] == ["1 of 4)", "2 of 4)", "3 of 4)", "4 of 4)"]
    assert (tmp_path / "bars.png").is_file()
    said = racecraft(*under, "--each", "--json")
    assert said.code == 0, said.err
    told = json.loads(said.out)
    names = [bar["disturbance"] for bar in told["bars"]]
    assert names[0] == "undisturbed"
    assert names[-1] == "all together"
    assert {"pitch", "noise", "latency", "grip"} <= set(names)
    assert not {"lamps", "object-colours"} & set(names), "not of this level, and nothing to colour in a time trial"
    for bar in told["bars"]:
        assert bar["mean_progress_low"] <= bar["mean_progress_percent"] <= bar["mean_progress_high"]
        assert sum(bar["ended"].values()) == bar["tries"] == 2
    kept = json.loads((tmp_path / "r" / "evaluations" / "reinvent_base-1-under-strong.json").read_text())
    assert kept["bars"] == told["bars"]
    again = json.loads(racecraft(*under, "--each", "--json").out)
    assert again["bars"] == told["bars"], "the same command tells the same"


WRONG = {
    "Did you mean 'strong'?": ["--under", "string"],
    "expected --under too": ["--each"],
    "--laps has no say": ["--under", "strong", "--laps", "2"],
    "--video, --max-resets": ["--under", "strong", "--video", "a.mp4", "--max-resets", "1"],
}


def test_what_cannot_be_judged_is_named(racecraft, run):
    for words, options in WRONG.items():
        said = racecraft("evaluate", "r", *options)
        assert (said.code, words in " ".join(said.err.split())) == (2, True), said


def test_a_sheet_shows_every_disturbance_that_is_seen(racecraft, tmp_path):
    said = racecraft("sensors", "--under", "strong", "-o", "sheet.png", "--json", *TINY[:4])
    assert said.code == 0, said.err
    rows = json.loads(said.out)["rows"]
    assert (rows[0], rows[-1]) == ("undisturbed", "all together")
    assert {"pitch", "roll", "glare", "noise", "blur"} <= set(rows)
    assert not {"latency", "dropped-frames"} & set(rows)
    assert (tmp_path / "sheet.png").stat().st_size > 10_000
    said = racecraft("sensors", "--under", "strung")
    assert (said.code, "no level of variation 'strung'" in said.err) == (2, True)


def laps(*progress):
    return Bar("x", LapReport(tuple(Lap(0, one, None, "off_track", 10) for one in progress)))


def test_an_interval_is_that_of_the_mean_and_narrows_with_the_tries():
    assert laps(100, 100, 100).interval == (100, 100)
    few, many = laps(*[0, 100] * 10).interval, laps(*[0, 100] * 100).interval
    told = laps(100, 100, 100).as_dictionary()
    assert (told["full_laps"], told["full_laps_share_low"]) == (0, 0.0)
    assert told["full_laps_share_high"] == pytest.approx(0.5615, abs=1e-4), "Wilson's: three tries are few"
    # By the normal law: 50 -+ 1.96 * 50 / sqrt(n).
    assert few == pytest.approx((50 - 21.9, 50 + 21.9), abs=3.5)
    assert many == pytest.approx((50 - 6.9, 50 + 6.9), abs=1.2)
