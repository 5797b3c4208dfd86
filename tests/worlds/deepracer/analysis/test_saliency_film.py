"""The film of a look: what stands below the camera is true of the policy, and says something."""

import math

import numpy as np
import pytest

from racecraft.analysis.attribution import Confidence
from racecraft.contract.world import ContinuousActions, DiscreteActions
from racecraft.worlds.deepracer.analysis.saliency import SaliencySeries
from racecraft.worlds.deepracer.analysis.saliency_film import look_pictures

THIRTY = math.radians(30.0)
NUMBERS = ContinuousActions(low=(-THIRTY, 0.5), high=(THIRTY, 2.0))
STEERING = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
T = len(STEERING)


def look(confidence, actions):
    return SaliencySeries("CAMERA", np.zeros((T, 30, 40), np.uint8), np.ones((T, 30, 40)), None, confidence, actions)


def of_numbers(deviations):
    none, numbers = np.full(T, np.nan), np.column_stack([STEERING, np.zeros(T)])
    spread = np.column_stack([deviations, np.ones(T)])
    return look(Confidence(np.zeros(T, int), np.zeros(T, int), none, none, none, numbers, spread), NUMBERS)


def of_choices(share):
    share = np.asarray(share, float)
    none = np.zeros((T, 0))
    sure = Confidence(np.zeros(T, int), np.ones(T, int), share, 1.0 - share, share, none, none)
    return look(sure, DiscreteActions(2, ("left", "right")))


def heights(one):
    """Where the film's dot stands in each picture, pixels from the top."""
    dots = []
    for picture in look_pictures(one, "a car"):
        below = picture[330:505, 320:640].astype(int)
        dots.append(float(np.argwhere(below.min(axis=-1) > 235)[:, 0].mean()))
    return np.array(dots)


@pytest.mark.parametrize(
    ("one", "shown"),
    [
        (of_numbers(np.full(T, 0.25)), STEERING),
        (of_numbers(np.linspace(0.1, 0.5, T)), np.linspace(0.1, 0.5, T)),
        (of_choices([0.9, 0.6, 0.8, 1.0, 0.7]), np.array([0.9, 0.6, 0.8, 1.0, 0.7])),
    ],
    ids=["one spread", "a spread of its own", "choices"],
)
def test_the_dot_stands_as_high_as_what_it_tells(one, shown):
    dots = heights(one)
    fit = np.polyfit(shown, dots, 1)
    assert fit[0] < -20.0, "higher is more"
    np.testing.assert_allclose(dots, np.polyval(fit, shown), atol=1.5)
