"""A scene's agents as PettingZoo sees them, told by hand what a session would bring."""

import numpy as np
import pytest

from racecraft.worlds.unity.env.behaviors import AgentRows, Behavior, Sensor, UnityActions
from racecraft.worlds.unity.env.builds import Build
from racecraft.worlds.unity.env.errors import UnityError
from racecraft.worlds.unity.env.parallel import unity_parallel
from racecraft.worlds.unity.env.session import Moment

pytest.importorskip("pettingzoo")
from gymnasium import spaces

SIGHT, EYE = Sensor("sight", (1,), (1,)), Sensor("eye", (1, 2, 3), (1, 2, 3), compressed=True)
BEHAVIORS = {
    "A?team=0": Behavior("A?team=0", (SIGHT, EYE), UnityActions(1, (2, 3))),
    "B?team=0": Behavior("B?team=0", (SIGHT,), UnityActions(2)),
    "C?team=0": Behavior("C?team=0", (SIGHT,), UnityActions(0, (4,))),
    "D?team=0": Behavior("D?team=0", (SIGHT,), UnityActions(0, (2, 2))),
}


def rows(name, agents, group=0.0, forbidden=(), interrupted=False):
    """Agents that each see their own number, and earn it."""
    ids = np.array(agents, np.int32)
    numbers = ids[:, None].astype(np.float32)
    behavior = BEHAVIORS[name]
    seen = [np.zeros((len(ids), *one.shape), one.dtype) if one is EYE else numbers for one in behavior.sensors]
    allowed = np.ones((len(ids), sum(behavior.actions.branches)), bool) if behavior.actions.branches else None
    if allowed is not None:
        allowed[:, list(forbidden)] = False
    shared = np.full(len(ids), group, np.float32)
    return AgentRows(ids, seen, numbers[:, 0].copy(), ids * 0, shared, np.full(len(ids), interrupted), allowed)


def heard(asking, ended=None, **words):
    """One moment: who asks and who ended, by behavior."""
    names = {*asking, *(ended or {})}
    return {
        name: Moment(rows(name, asking.get(name, []), **words), rows(name, (ended or {}).get(name, []), **words))
        for name in BEHAVIORS
        if name in names
    }


class Told:
    """A session whose moments are told beforehand."""

    behaviors = BEHAVIORS

    def __init__(self, build, **options):
        self.options, self.choices, self.closed = options, [], 0
        Told.opened.append(self)

    def reset(self):
        return Told.moments.pop(0)

    def step(self, choices):
        self.choices.append(choices)
        return Told.moments.pop(0)

    def close(self):
        self.closed += 1


@pytest.fixture
def play(monkeypatch):
    def begin(*moments, build=Build("game", ("x",)), **options):  # noqa: B008
        monkeypatch.setattr("racecraft.worlds.unity.env.parallel.Session", Told)
        Told.opened, Told.moments = [], list(moments)
        return unity_parallel(build, **options), Told.opened

    return begin


A, B, C, D = (f"{name}?team=0" for name in "ABCD")
FIRST, SECOND = f"{A}?agent_id=0", f"{A}?agent_id=1"


def test_spaces_are_told_by_what_each_behavior_sees_and_does(play):
    env, _ = play(heard({A: [7, 9], B: [1], C: [1], D: [1]}))
    assert env.possible_agents == [FIRST, SECOND, *(f"{name}?agent_id=0" for name in (B, C, D))]
    assert (env.agents, env.metadata["name"], env.render_mode) == ([], "unity/game", None)
    sees = env.observation_space(FIRST)
    assert sees == spaces.Dict(
        {"sight": spaces.Box(-np.inf, np.inf, (1,), np.float32), "eye": spaces.Box(0, 255, (1, 2, 3), np.uint8)}
    )
    assert env.observation_space(f"{B}?agent_id=0") == spaces.Box(-np.inf, np.inf, (1,), np.float32)
    numbers = spaces.Box(-1.0, 1.0, (1,), np.float32)
    assert env.action_space(SECOND) == spaces.Tuple((numbers, spaces.MultiDiscrete([2, 3])))
    assert env.action_space(f"{B}?agent_id=0") == spaces.Box(-1.0, 1.0, (2,), np.float32)
    assert env.action_space(f"{C}?agent_id=0") == spaces.Discrete(4)
    assert env.action_space(f"{D}?agent_id=0") == spaces.MultiDiscrete([2, 2])


def test_actions_of_every_kind_reach_the_agents_in_the_order_in_which_they_asked(play):
    """Who is told nothing does nothing: zeros, and the first choice that is allowed."""
    everybody = heard({A: [7, 9], B: [1], C: [1], D: [1]}, forbidden=[0])
    env, (session,) = play(everybody, everybody)
    env.reset()
    env.step({
        SECOND: (np.array([0.5]), np.array([1, 2])), f"{B}?agent_id=0": np.array([-0.5, 0.25]),
        f"{C}?agent_id=0": 3, f"{D}?agent_id=0": [1, 1],
    })  # fmt: skip
    (choices,) = session.choices
    assert (choices[A].continuous.tolist(), choices[A].discrete.tolist()) == ([[0.0], [0.5]], [[1, 0], [1, 2]])
    assert (choices[B].continuous.tolist(), choices[B].discrete) == ([[-0.5, 0.25]], None)
    assert (choices[C].continuous, choices[C].discrete.tolist()) == (None, [[3]])
    assert choices[D].discrete.tolist() == [[1, 1]]


def test_rewards_are_an_agents_own_and_its_groups_and_the_first_is_nobodys(play):
    env, _ = play(
        heard({A: [7, 9]}), heard({A: [7, 9]}, group=0.5), heard({A: [7]}, {A: [9]}, group=0.5, interrupted=True)
    )
    seen, infos = env.reset()
    assert [seen[name]["sight"].tolist() for name in (FIRST, SECOND)] == [[7], [9]]
    assert infos[FIRST]["action_mask"].tolist() == [True] * 5
    _, rewards, terminated, truncated, _ = env.step({})
    assert rewards == {FIRST: 7.5, SECOND: 9.5}
    assert (terminated, truncated) == ({FIRST: False, SECOND: False}, {FIRST: False, SECOND: False})
    seen, rewards, terminated, truncated, _ = env.step({})
    assert rewards == {FIRST: 7.5, SECOND: 9.5}
    assert (terminated, truncated) == ({FIRST: False, SECOND: False}, {FIRST: False, SECOND: True})
    assert env.agents == [FIRST]


def test_who_has_left_is_led_on_and_not_shown_until_all_have(play):
    """Agent 7 ends and comes back as 8; it does what is allowed first, whatever is told to its place."""
    env, (session,) = play(
        heard({B: [7, 9]}),
        heard({B: [8, 9]}, {B: [7]}),
        heard({B: [8]}, {}),
        heard({B: [8, 9]}, {}),
        heard({}, {B: [8, 9]}),
    )
    env.reset()
    one, other = (f"{B}?agent_id={place}" for place in (0, 1))
    _, rewards, terminated, _, infos = env.step({one: [1, 1], other: [0.5, 0.5]})
    assert (terminated, rewards, infos) == ({one: True, other: False}, {one: 7.0, other: 9.0}, {one: {}, other: {}})
    seen, rewards, *_ = env.step({one: [1, 1], other: [0.5, 0.5]})
    assert (list(seen), rewards) == ([other], {other: 9.0}), "a message without anybody who plays is passed over"
    assert [choices[B].continuous.tolist() for choices in session.choices] == [
        [[1, 1], [0.5, 0.5]], [[0, 0], [0.5, 0.5]], [[0, 0]],
    ]  # fmt: skip
    _, _, terminated, _, _ = env.step({other: [0, 0]})
    assert (terminated, env.agents) == ({other: True}, [])


def test_a_seed_brings_a_new_player_and_none_begins_in_place(play):
    moments = [heard({B: [number]}) for number in range(4)]
    env, opened = play(*moments, seed=1, args=("--x",))
    name = f"{B}?agent_id=0"
    assert env.reset()[0][name].tolist() == [0], "the first moment is not asked for again"
    assert env.reset()[0][name].tolist() == [1]
    assert env.reset(seed=5)[0][name].tolist() == [2]
    assert [session.options for session in opened] == [{"seed": 1, "args": ("--x",)}, {"seed": 5, "args": ("--x",)}]
    assert [session.closed for session in opened] == [1, 0]
    env.close()
    assert opened[1].closed == 1


def test_who_joins_later_is_told_that_nobody_may(play):
    env, _ = play(heard({B: [1]}), heard({B: [1, 2]}))
    env.reset()
    with pytest.raises(UnityError, match="agent 2 of 'B.team=0' joined a game of 1 agents"):
        env.step({})


def test_a_scene_that_does_not_begin_is_closed(play, monkeypatch):
    def broken(self):
        raise UnityError("it does not begin")

    monkeypatch.setattr(Told, "reset", broken)
    with pytest.raises(UnityError, match="does not begin"):
        play()
    assert [session.closed for session in Told.opened] == [1]
