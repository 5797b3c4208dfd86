"""Environments by name: ids that are registered, classes of one's own, and what is neither."""

import gymnasium
import pytest

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.gymnasium.env.from_gymnasium import GymnasiumWorld
from racecraft.worlds.gymnasium.evaluation import (
    open_judging_world,
    open_world,
    opened_judging_world,
    own_class,
    reward_threshold,
)

OWN = """
import gymnasium
import numpy as np

SIZE = 3


class Room(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(0.0, 1.0, (2,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)
    reward_threshold = 25
    closed = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return np.zeros(2, np.float32), {}

    def step(self, action):
        return np.zeros(2, np.float32), 1.0, False, False, {}

    def close(self):
        Room.closed += 1


class Whole:
    def __init__(self, num_worlds):
        self.num_worlds = num_worlds

    spec = reset = step = save_state = load_state = close = None


class Half(Whole):
    save_state = property(lambda self: self.nothing)
    close = property(lambda self: self.nothing)


class Wants:
    def __init__(self, num_worlds, more):
        pass
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A module of the user's own, in the present folder."""
    (tmp_path / "rooms_of_mine.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return "rooms_of_mine"


def test_a_class_is_found_by_its_name_and_an_id_is_none(own):
    assert own_class("CartPole-v1") is None
    assert own_class("gymnasium:CartPole-v1") is None
    assert own_class(f"{own}:Room").__name__ == "Room"
    with pytest.raises(SettingError, match="is int, no class"):
        own_class(f"{own}:SIZE")


def test_an_environment_is_solved_where_it_or_its_registration_says_so(own):
    assert reward_threshold("CartPole-v1") == 475.0, "as Gymnasium's page of it says"
    assert reward_threshold("gymnasium:CartPole-v1") == 475.0
    threshold = reward_threshold(f"{own}:Room")
    assert (threshold, type(threshold)) == (25.0, float)
    assert reward_threshold(f"{own}:Whole") is None


@pytest.mark.parametrize("opened", [open_world, open_judging_world])
def test_a_class_of_ones_own_is_opened_as_what_it_is(own, opened):
    room = opened(f"{own}:Room", 3)
    assert isinstance(room, GymnasiumWorld)
    assert room.spec.num_worlds == 3
    room.close()
    assert opened(f"{own}:Whole", 4).num_worlds == 4


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Half", "lacks save_state, close; expected a subclass of gymnasium.Env"),
        ("Wants", "'more'; expected a World that is made with num_worlds=N"),
    ],
)
def test_a_class_of_another_shape_is_told_what_it_lacks(own, name, words):
    with pytest.raises(SettingError, match=words):
        open_world(f"{own}:{name}", 1)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("CartPoll-v1", "no Gymnasium environment 'CartPoll-v1'. Did you mean 'CartPole-v1'"),
        ("no_such_package:Thing-v0", "there is no module 'no_such_package'"),
    ],
)
def test_an_id_that_is_none_is_named_with_its_nearest_or_with_what_it_lacks(name, words):
    with pytest.raises(UserInputError, match=words):
        open_judging_world(name, 1)
    with pytest.raises(UserInputError, match=words):
        reward_threshold(name)


@pytest.mark.parametrize("opened", [open_world, open_judging_world])
@pytest.mark.parametrize("name", ["from_script/Mine-v0", "racecraft.compat.script_worlds:Mine"])
def test_what_a_script_made_is_not_opened_where_it_did_not_run(opened, name):
    with pytest.raises(SettingError, match="a script made this environment"):
        opened(name, 1)


def test_a_run_is_judged_in_what_its_own_code_makes_and_it_is_closed_behind(tmp_path):
    """A launcher script's environment lives in the run's code; it is made anew where this process has none."""
    run = RunFolder.create(tmp_path / "run", {"asked": {"environment": "from_script/Held-v0"}})
    code = run.path / "code"
    code.mkdir(exist_ok=True)
    (code / "script_environment.py").write_text(
        OWN + "\n\ngymnasium.register('from_script/Held-v0', entry_point=Room, max_episode_steps=5)\n"
    )
    try:
        with opened_judging_world(run, 2) as world:
            assert world.spec.num_worlds == 2
            room = gymnasium.spec("from_script/Held-v0").entry_point
            assert room.closed == 0
        assert room.closed == 2
    finally:
        gymnasium.registry.pop("from_script/Held-v0", None)
