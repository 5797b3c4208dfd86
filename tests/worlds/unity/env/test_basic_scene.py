"""The built-in stand-in of Unity's Basic scene, by hand and without a wire."""

import pytest

from racecraft.worlds.unity.env.basic_scene import BEHAVIOR, BasicScene
from racecraft.worlds.unity.env.player import ActionMessage

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
        scene.act({BEHAVIOR: [ActionMessage([], [choice])]})
    assert told(scene) == [(place, pytest.approx(reward), done) for place, reward, done in rows]


def ids(scene):
    return [(one.agent_id, one.done) for one in scene.infos()[BEHAVIOR]]


def test_each_episode_has_a_new_agent_id_and_ends_are_told_once():
    scene = BasicScene(2)
    scene.reset()
    assert ids(scene) == [(0, False), (1, False)]
    for _ in range(3):
        scene.act({BEHAVIOR: [ActionMessage([], [LEFT]), ActionMessage([], [RIGHT])]})
    assert ids(scene) == [(0, True), (2, False), (1, False)]
    assert ids(scene) == [(2, False), (1, False)]
    for _ in range(4):
        scene.act({BEHAVIOR: [ActionMessage([], [STAY]), ActionMessage([], [RIGHT])]})
    assert ids(scene) == [(1, True), (2, False), (3, False)]


def test_a_late_start_is_one_message_late_or_is_brought_by_a_reset():
    scene = BasicScene(2, late_start=True)
    scene.reset()
    asking = []
    for choices in ([LEFT, STAY], [LEFT, STAY], [LEFT, STAY], [RIGHT]):
        scene.act({BEHAVIOR: [ActionMessage([], [choice]) for choice in choices]})
        asking.append(ids(scene))
    assert asking[2:] == [[(0, True), (1, False)], [(2, False), (1, False)]]
    assert told(scene) == [(10, 0.0, False), (11, -0.01, False)]
    for choice in (LEFT, LEFT, LEFT):
        scene.act({BEHAVIOR: [ActionMessage([], [choice]), ActionMessage([], [STAY])]})
    scene.reset()
    assert ids(scene) == [(3, False), (1, False)]
