"""The built-in stand-in of Unity's Basic scene, by hand and without a wire."""

import pytest

from racecraft.envs.unity.basic_scene import BEHAVIOR, BasicScene
from racecraft.envs.unity.player import Act

STAY, LEFT, RIGHT = range(3)


def told(scene):
    return [(int(one.observations[0].values.argmax()), one.reward, one.done) for one in scene.infos()[BEHAVIOR]]


@pytest.mark.parametrize(
    ("choices", "rows"),
    [
        ((STAY,), [(10, -0.01, False)]),
        ((LEFT, LEFT), [(8, -0.01, False)]),
        ((LEFT, LEFT, LEFT), [(7, 0.09, True), (10, 0.0, False)]),
        ((RIGHT,) * 7, [(17, 0.99, True), (10, 0.0, False)]),
    ],
)
def test_it_moves_and_pays_as_unitys_does(choices, rows):
    scene = BasicScene()
    scene.reset()
    assert told(scene) == [(10, 0.0, False)]
    for choice in choices:
        scene.act({BEHAVIOR: [Act([], [choice])]})
    assert told(scene) == [(place, pytest.approx(reward), done) for place, reward, done in rows]


def test_an_end_that_nobody_has_heard_of_is_forgotten_at_a_reset():
    scene = BasicScene()
    scene.reset()
    for _ in range(3):
        scene.act({BEHAVIOR: [Act([], [LEFT])]})
    scene.reset()
    assert told(scene) == [(10, -0.01, False)]
