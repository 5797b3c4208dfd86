"""What survives of laps: intervals by law, rows by hand, and which starts and disturbances are driven."""

from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.env.variation import VariationConfig, disturbances_of, only
from racecraft.worlds.deepracer.evaluation import robustness
from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport
from racecraft.worlds.deepracer.evaluation.robustness import (
    ALL,
    UNDISTURBED,
    Bar,
    RobustnessReport,
    judge_under,
    requested_names,
)


def came(*progress):
    laps = [Lap(0.0, float(one), 10.0 if one == 100 else None, "lap_complete" if one == 100 else "off_track", 9)
            for one in progress]  # fmt: skip
    return LapReport(tuple(laps))


def test_tries_that_came_equally_far_leave_no_width():
    assert Bar("glare", came(40, 40, 40)).interval == (40.0, 40.0)


def test_of_two_tries_a_quarter_of_the_draws_is_the_one_alone_and_a_quarter_the_other():
    assert Bar("glare", came(0, 100)).interval == (0.0, 100.0)


def test_many_tries_lie_about_their_mean_as_its_standard_error_says():
    tries = np.random.default_rng(1).uniform(20.0, 80.0, 200)
    low, high = Bar("glare", came(*tries)).interval
    half = 1.96 * tries.std() / np.sqrt(200)
    assert (low, high) == pytest.approx((tries.mean() - half, tries.mean() + half), abs=0.15)


def test_a_row_tells_tries_laps_and_ends_by_hand():
    told = Bar("glare", came(100, 100, 12.3456, 50)).as_dictionary()
    assert (told["disturbance"], told["tries"], told["full_laps"], told["best_lap_seconds"]) == ("glare", 4, 2, 10.0)
    assert told["mean_progress_percent"] == 65.586
    assert told["ended"] == {"lap_complete": 2, "off_track": 2}
    # Wilson's interval of 2 in 4, known from its tables: 15.0 to 85.0 %.
    assert (told["full_laps_share_low"], told["full_laps_share_high"]) == (0.15, 0.85)
    assert told["mean_progress_low"] == round(told["mean_progress_low"], 3) >= 12.346
    assert told["mean_progress_high"] == round(told["mean_progress_high"], 3) <= 100
    report = RobustnessReport("strong", (Bar("glare", came(100, 100, 12.3456, 50)),))
    assert report.as_dictionary() == {"under": "strong", "confidence": 0.95, "bars": [told]}


@pytest.mark.parametrize(("asked", "tries", "seed"), [({}, 20, 0), ({"tries": 4, "seed": 9}, 4, 9)])
def test_every_row_drives_the_same_starts_evenly_round_the_lap(monkeypatch, asked, tries, seed):
    driven, judged = [], []
    car = SimpleNamespace(policy="drives", world=lambda track, **how: driven.append((track, how)) or len(driven))
    judge = lambda policy, world, seed, on_progress: judged.append((policy, world, seed)) or came(100)  # noqa: E731
    monkeypatch.setattr(robustness, "judge_starts", judge)
    bars = list(judge_under(car, "a track", "strong", ["glare", "noise"], **asked))
    assert [bar.name for bar in bars] == [UNDISTURBED, "glare", "noise", ALL]
    assert [how["variation"] for _, how in driven] == [
        VariationConfig(), only("strong", ["glare"]), only("strong", ["noise"]), VariationConfig("strong"),
    ]  # fmt: skip
    for track, how in driven:
        assert (track, how["num_cars"]) == ("a track", tries)
        assert how["start_shares"] == pytest.approx(np.arange(tries) / tries)
    assert judged == [("drives", world, seed) for world in (1, 2, 3, 4)]


def test_disturbances_are_those_named_else_all_where_each_is_asked_and_objects_have_theirs():
    timed = SimpleNamespace(settings=SimpleNamespace(race=SimpleNamespace(type="TIME_TRIAL")))
    boxes = SimpleNamespace(settings=SimpleNamespace(race=SimpleNamespace(type="OBJECT_AVOIDANCE")))
    assert requested_names(timed, "strong", each=False) == []
    assert requested_names(timed, "strong", each=True) == disturbances_of("strong", False)
    assert requested_names(boxes, "strong", each=True) == disturbances_of("strong", True)
    assert set(disturbances_of("strong", True)) > set(disturbances_of("strong", False))
    assert requested_names(timed, "strong", each=True, named=["glare"]) == ["glare"]
    with pytest.raises(SettingError, match="Did you mean 'glare'"):
        requested_names(timed, "strong", each=False, named=["glair"])
