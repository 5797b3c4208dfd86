"""Which car was recorded: by how far each strays with an interval, and by what the simulator says of its build."""

import math

import numpy as np
import pytest

from racecraft.worlds.deepracer.evaluation.car_verdict import judge_car


def errors(count=400, **medians):
    """Distances of so many windows, each car's scattered by the same third round its median, m."""
    spread = np.random.default_rng(1).lognormal(0.0, 0.33, (len(medians), count))
    return {car.replace("_", "-"): far * one for (car, far), one in zip(medians.items(), spread, strict=True)}


def test_the_car_that_strays_clearly_least_is_the_recorded_one():
    verdict = judge_car(errors(v4=0.31, v5_classic=0.54, v6=0.09))
    assert (verdict.car, verdict.nearest) == ("v6", "v6")
    low, high = verdict.ratio
    assert 2.5 < low < 0.31 / 0.09 < high < 4.5
    assert "the next car strays" in verdict.text()


def test_cars_that_stray_alike_are_not_told_apart():
    """A public console log of version 5 at 0.7 m/s: 11.5, 12.2 and 11.1 cm in 2,844 windows."""
    verdict = judge_car(errors(2844, v4=0.115, v5_classic=0.122, v6=0.111))
    assert verdict.car is None
    assert verdict.ratio[1] < 1.3
    assert "cannot tell" in verdict.text()


def test_the_fewer_windows_the_wider_the_interval():
    few, many = (judge_car(errors(count, v4=0.10, v5_classic=0.16, v6=0.3)) for count in (24, 2400))
    assert (few.car, many.car) == (None, "v4")
    assert few.ratio[0] < many.ratio[0] < many.ratio[1] < few.ratio[1]


@pytest.mark.parametrize(("count", "car"), [(19, None), (20, "v4")])
def test_fewer_than_twenty_windows_of_a_second_tell_nothing(count, car):
    far = errors(count, v4=0.01, v5_classic=1.0, v6=1.0)
    far = {name: np.append(one, [math.nan] * 5) for name, one in far.items()}
    assert judge_car(far).car == car


def test_the_build_leaves_only_the_cars_it_had():
    far = errors(v4=0.3, v5_classic=0.12, v6=0.05)
    assert judge_car(far).car == "v6"
    assert judge_car(far, "ROS 1").car == "v5-classic"
    assert judge_car(errors(v4=0.05, v5_classic=0.12, v6=0.3), "ROS 2").car == "v6"
    assert judge_car({name: one[:0] for name, one in far.items()}, "ROS 2").car == "v6", "without any window"
    assert judge_car({name: one[:0] for name, one in far.items()}).car is None
