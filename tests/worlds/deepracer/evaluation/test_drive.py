"""What is kept of one car, tick by tick: its own reports, and the objects of its own world."""

import numpy as np
import pytest

from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.drive import DriveKeeper


class Moves(RaceWorld):
    """Two worlds of two cars, whose every figure tells where it stands and when."""

    seen_boxes = kinds = None

    def __init__(self):
        self.reports = np.zeros((2, 2), race.TICK_REPORT)
        self.reports["x"] = [[0.0, 1.0], [10.0, 11.0]]
        self.seen_boxes = np.arange(2.0)[:, None, None] + np.zeros((2, 3, 6))
        self.kinds = np.array([[1, 2, 3], [4, 5, 6]])

    def tick(self):
        self.reports["x"] += 100
        self.seen_boxes += 100


@pytest.mark.parametrize(("place", "x", "box", "kinds"), [((), 0.0, 0.0, [1, 2, 3]), ((1, 1), 11.0, 1.0, [4, 5, 6])])
def test_the_car_that_was_named_is_kept_else_the_first(place, x, box, kinds):
    world, keeper = Moves(), DriveKeeper(*place)
    assert (len(keeper.drive), keeper.objects) == (0, None)
    for _ in range(3):
        keeper(world, None, None)
        world.tick()
    assert keeper.drive["x"].tolist() == [x, x + 100, x + 200]
    assert keeper.drive.dtype == race.TICK_REPORT
    boxes, told = keeper.objects
    assert boxes.shape == (3, 3, 6)
    assert boxes[:, 0, 0].tolist() == [box, box + 100, box + 200]
    assert told.tolist() == [kinds] * 3
