"""A Gymnasium environment that writes down what it is asked, as a world of several copies."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from numpy.testing import assert_array_equal

from racecraft.contract.errors import ContractError, EnvironmentFailedError
from racecraft.contract.world import DiscreteActions, allocate
from racecraft.worlds.gymnasium.env.from_gymnasium import GymnasiumWorld


class Diary(gymnasium.Env):
    """Choices 2 to 4; places 10 to 13, one further each tick; the third tick of an episode ends it."""

    def __init__(self, ends_by_clock=False, place=10):
        self.observation_space = spaces.Dict(
            place=spaces.Discrete(4, start=10),
            much=spaces.Box(np.array([-1.0, -3.0]), np.array([5.0, 2.0]), dtype=np.float64),
        )
        self.action_space = spaces.Discrete(3, start=2)
        self.ends_by_clock, self.first = ends_by_clock, place
        self.seeds, self.told, self.closed = [], [], 0

    def reset(self, *, seed=None, options=None):
        self.seeds.append(seed)
        self.tick = 0
        return self.seen(), {}

    def step(self, action):
        self.told.append(action)
        self.tick += 1
        over = self.tick == 3
        return self.seen(), 0.5 * action, over and not self.ends_by_clock, over and self.ends_by_clock, {}

    def seen(self):
        return {"place": self.first + self.tick, "much": np.array([self.tick, -self.tick], float)}

    def close(self):
        self.closed += 1


def diaries(count, **words):
    """A world of diaries, its buffers and the diaries."""
    made = []

    def make():
        made.append(Diary(**words))
        return made[-1]

    world = GymnasiumWorld(make, count)
    return world, allocate(world.spec), made


def test_choices_that_begin_elsewhere_are_told_from_none_and_places_are_shown_as_one_of_so_many():
    world, buffers, made = diaries(2)
    spec = world.spec
    assert (spec.name, spec.num_worlds, spec.num_agents, spec.actions) == ("Diary", 2, 1, DiscreteActions(3))
    assert {name: (one.shape, np.dtype(one.dtype), one.low, one.high) for name, one in spec.observations.items()} == {
        "place": ((4,), np.float32, 0.0, 1.0),
        "much": ((2,), np.float32, -3.0, 5.0),
    }
    world.reset(buffers, 0)
    assert buffers.active.all()
    assert_array_equal(buffers.observations["place"][:, 0], [[1, 0, 0, 0]] * 2)
    world.step(np.array([[0], [2]]), buffers)
    assert [one.told for one in made] == [[2], [4]]
    assert type(made[0].told[0]) is int
    assert_array_equal(buffers.reward, [[1.0], [2.0]])
    assert_array_equal(buffers.observations["place"][:, 0], [[0, 1, 0, 0]] * 2)
    assert_array_equal(buffers.observations["much"][:, 0], [[1, -1]] * 2)
    assert not buffers.ended.any()


@pytest.mark.parametrize("by_clock", [False, True])
def test_an_ended_copy_begins_again_in_the_same_tick_with_its_end_kept(by_clock):
    world, buffers, made = diaries(1, ends_by_clock=by_clock)
    world.reset(buffers, 0)
    for _ in range(3):
        world.step(np.array([[1]]), buffers)
    assert (bool(buffers.terminated[0, 0]), bool(buffers.truncated[0, 0])) == (not by_clock, by_clock)
    assert_array_equal(buffers.final_observations["place"][0, 0], [0, 0, 0, 1])
    assert_array_equal(buffers.observations["place"][0, 0], [1, 0, 0, 0])
    assert len(made[0].seeds) == 2
    world.step(np.array([[1]]), buffers)
    assert not buffers.ended.any()


def test_every_episode_of_every_copy_has_a_seed_of_its_own_that_does_not_ask_for_its_neighbours():
    def seeds(count, seed):
        world, buffers, made = diaries(count)
        world.reset(buffers, seed)
        for _ in range(9):
            world.step(np.zeros((count, 1), np.int64), buffers)
        return [one.seeds for one in made]

    three = seeds(3, 5)
    assert all(len(one) == 4 for one in three)
    every = [seed for one in three for seed in one]
    assert len(set(every)) == 12
    assert all(0 <= seed < 2**31 for seed in every)
    assert max(every) > 2**28, "they are drawn from all of them"
    assert seeds(2, 5) == three[:2]
    assert seeds(1, 6) != three[:1]


def test_a_saved_world_is_its_seed_its_episodes_and_what_was_done_in_them():
    world, buffers, ours = diaries(2)
    world.reset(buffers, 8)
    world.freeze(np.array([[False], [True]]))
    for action in (0, 2, 1, 2):
        world.step(np.full((2, 1), action), buffers)
    state = world.save_state()
    assert {name: array.tolist() for name, array in state.items()} == {
        "seed": 8, "episode": [1, 0], "lengths": [1, 0], "actions": [[2], [0]],
    }  # fmt: skip
    other, again, made = diaries(2)
    other.load_state(state, again)
    assert again.active.all()
    assert [one.told for one in made] == [[4], []]
    assert_array_equal(again.observations["place"], buffers.observations["place"])
    other.step(np.array([[1], [1]]), again)
    assert [one.told for one in made] == [[4, 3], [3]], "nobody is parked any more"
    assert other.save_state()["lengths"].tolist() == [2, 1]
    world.reset(buffers, 8)
    for _ in range(6):
        world.step(np.zeros((2, 1), np.int64), buffers)
    other.step(np.array([[1], [1]]), again)
    assert made[0].seeds[-1] == ours[0].seeds[-1], "its third episode begins as in the world that was saved"
    fresh, buffers, _ = diaries(2)
    fresh.reset(buffers, 3)
    assert fresh.save_state()["actions"].shape == (2, 0)


def test_of_a_parked_copy_nothing_comes_whatever_the_buffers_held():
    world, buffers, made = diaries(2)
    world.reset(buffers, 0)
    world.freeze(np.array([[False], [True]]))
    dirty = allocate(world.spec)
    dirty.reward[:], dirty.terminated[:], dirty.truncated[:], dirty.active[:] = 9.0, True, True, False
    world.step(np.array([[0], [0]]), dirty)
    assert [len(one.told) for one in made] == [1, 0]
    assert_array_equal(dirty.reward, [[1.0], [0.0]])
    assert not dirty.ended.any()
    assert dirty.active.all()
    assert_array_equal(dirty.observations["place"][1, 0], [1, 0, 0, 0])


def test_a_world_is_begun_before_it_is_stepped_and_closed_once():
    world, buffers, made = diaries(2)
    with pytest.raises(ContractError, match="Diary: step before reset"):
        world.step(np.zeros((2, 1), np.int64), buffers)
    world.close()
    world.close()
    assert [one.closed for one in made] == [1, 1]


@pytest.mark.parametrize(("place", "method"), [(14, "reset"), (13, "step"), (9, "reset")])
def test_a_place_that_was_not_promised_is_a_letter(place, method):
    world, buffers, _ = diaries(1, place=place)

    def play():
        world.reset(buffers, 0)
        world.step(np.array([[0]]), buffers)

    with pytest.raises(EnvironmentFailedError, match=rf"Diary\.{method} gave .* as observation"):
        play()
