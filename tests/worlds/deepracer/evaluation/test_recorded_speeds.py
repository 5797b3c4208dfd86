"""How fast a recorded car was in a window, and how far ours may stray from it there: by hand, and by the page."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.worlds.deepracer.evaluation import car_verdict, replay_report
from racecraft.worlds.deepracer.evaluation.car_verdict import RECORDED_CARS
from racecraft.worlds.deepracer.evaluation.open_loop import real_speeds

PAGE = Path(__file__).resolve().parents[4] / "docs" / "fidelity.md"


def test_the_speed_of_a_window_is_the_way_of_its_ticks_over_their_time():
    """By hand: 0.1 m a tick of 1/15 s are 1.5 m/s, on a straight and round a corner; then the car stands."""
    x = np.array([0.0, 0.1, 0.2, 0.3, 0.3, 0.3, 0.3])
    y = np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.1, 0.1])
    windows = SimpleNamespace(first=np.array([0, 0, 2, 4]), ticks=np.array([3, 4, 2, 2]))
    assert np.allclose(real_speeds(SimpleNamespace(columns={"X": x, "Y": y}), windows), [1.5, 1.5, 1.5, 0.0])


def test_the_page_tells_the_limits_a_car_is_called_the_same_by():
    """In cm below and above 2 m/s; the aims that recordings of others were to stay within."""
    page = " ".join(PAGE.read_text(encoding="utf-8").split())
    told = re.search(r"at most (\d+) cm \(`v4`\), (\d+) cm \(`v5-classic`\) or (\d+) cm \(`v6`\).*?below 2 m/s, "
                     r"and (\d+), (\d+) or (\d+) cm above", page)  # fmt: skip
    cm = [int(number) / 100 for number in told.groups()]
    limits = [replay_report.SAME_CAR_M.get(car, replay_report.OTHER_SAME_CAR_M) for car in RECORDED_CARS]
    assert list(zip(cm[:3], cm[3:], strict=True)) == limits
    assert replay_report.FAST_MPS == 2.0
    assert replay_report.FEWEST_WINDOWS == car_verdict.MIN_WINDOWS == 20


@pytest.mark.parametrize("car", ["v4", "v5-classic", "v6"])
@pytest.mark.parametrize(("speed", "band"), [(0.5, 0), (1.999, 0), (2.0, 1), (4.0, 1)])
def test_a_car_is_the_same_up_to_its_limit_and_two_metres_a_second_are_fast(car, speed, band):
    limit = replay_report.SAME_CAR_M.get(car, replay_report.OTHER_SAME_CAR_M)[band]
    for strayed, is_same in ((limit, True), (limit + 0.01, False)):
        told = SimpleNamespace(car=car, _by_speed=lambda _, far=strayed: (np.full(20, far), np.full(20, speed)))
        assert replay_report.ReplayReport.is_same_car.fget(told) is is_same


def test_a_median_of_medians_stays_within_the_aims_on_recordings_that_were_not_fitted_to():
    """The page's own tables: of each car the recordings without "(seen)", and the line of all unseen windows."""
    text = PAGE.read_text(encoding="utf-8").split("## What the recordings taught us")[0]
    for car, (slow, fast) in replay_report.SAME_CAR_M.items():
        table = text.split(f"| `{car}` | windows |")[1].split("\n\n")[0]
        unseen = [line for line in table.splitlines() if "|" in line and "(seen)" not in line and "unseen" not in line]
        below, above = ([], [])
        for line in unseen[2:]:
            shipped = line.split("|")[-2].replace("*", "").split("/")
            below += [float(number) for number in shipped[0].split(",")]
            above += [float(number) for number in shipped[1].split(",") if number.strip() != "–"] if shipped[1:] else []
        assert len(below) >= 5, car
        assert np.median(below) <= slow, (car, below)
        assert np.median(above) <= fast, (car, above)
