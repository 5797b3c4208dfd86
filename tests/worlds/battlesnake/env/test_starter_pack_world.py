"""By twin: the compiled starter pack and the readable one, turn by turn; the exam; and the original's own figures."""

import numpy as np
import pytest

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.world import allocate
from racecraft.worlds.battlesnake.env import starter_pack
from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.kernels import starter_pack as pack
from racecraft.worlds.battlesnake.env.source_experiment import ExactGames, MaskedExactGames, MaskedStarterPackGames
from racecraft.worlds.battlesnake.env.starter_pack import Rewards, Snake, StarterPackGym
from racecraft.worlds.battlesnake.env.starter_pack_world import StarterPackWorld

KEYS = tuple(Rewards.__dataclass_fields__)
DISTINCT = Rewards(**{key: 2.0**n for n, key in enumerate(KEYS)})
"""Prices whose sum tells which were paid."""
PAID_AT_DEATH = DISTINCT.died


class TestStarterPackWorld(WorldConformance):
    ticks = 80

    def make_world(self, num_worlds):
        return StarterPackWorld(num_worlds, side=7, max_turns=12, is_masked=True)


class TestMaskedGames(WorldConformance):
    ticks = 60

    def make_world(self, num_worlds):
        return MaskedStarterPackGames(num_worlds)


class TestExactGames(WorldConformance):
    ticks = 60

    def make_world(self, num_worlds):
        return ExactGames(num_worlds)


def gym_of(world, game):
    """Return the readable gym in the position of one game."""
    gym = StarterPackGym("max-bordered-51s", world.food.shape[1:], world.spec.num_agents, rewards=DISTINCT)
    gym.reset()
    gym.snakes = []
    for row, body in zip(world.snakes[game], world.bodies[game], strict=True):
        squares = [tuple(map(int, square)) for square in body[: row[pack.LENGTH]]]
        facing = None if row[pack.FACING] < 0 else int(row[pack.FACING])
        alive, stacked, fed = bool(row[pack.ALIVE]), int(row[pack.STACKED]), bool(row[pack.FED])
        gym.snakes.append(Snake(squares, int(row[pack.HEALTH]), facing, alive, int(row[pack.AGE]), stacked, fed))
    gym.food = {tuple(map(int, square)) for square in np.argwhere(world.food[game])}
    gym.turn = int(world.turns[game])
    return gym


def planes_of(state, me):
    """Return what the pack's own trainer made of a state for one snake: food, itself, the sum of the others."""
    others = [m for m in range(state.shape[2] - 1) if m != me]
    return np.stack([state[..., 0], state[..., 1 + me], state[..., [1 + m for m in others]].sum(axis=-1)], axis=-1)


@pytest.mark.parametrize(
    ("side", "snakes", "safe"), [(7, 5, 0.9), (5, 4, 0.8), (11, 5, 0.98), (4, 2, 0.95), (6, 8, 0.9)]
)
def test_the_compiled_rules_are_the_readable_ones(monkeypatch, side, snakes, safe):
    monkeypatch.setattr(starter_pack, "FOOD_CHANCE", 0.0)  # what falls is the compiled world's; it is compared apart
    world = StarterPackWorld(1, side, snakes, DISTINCT, max_turns=0, is_masked=True)
    buffers, rng = allocate(world.spec), np.random.default_rng(side)
    seen = set()
    for start in range(15):
        world.reset(buffers, start)
        for _ in range(60):
            gym, alive = gym_of(world, 0), world.snakes[0, :, pack.ALIVE].astype(bool)
            state = gym._state()
            for m in np.flatnonzero(alive):
                np.testing.assert_array_equal(buffers.observations["planes"][0, m], planes_of(state, m))
            liking = rng.random((1, snakes, 4)) * np.where(rng.random((1, snakes, 1)) < safe, buffers.action_mask, True)
            actions = liking.argmax(axis=-1)
            _, paid, dones, info = gym.step(actions[0])
            over = gym.over
            # The turn alone, so that the position after it can be looked at before the next game begins.
            pack.play_turns(
                actions, world.bodies, world.snakes, world.food, world.turns, world.chance, world._prices, 0,
                buffers.reward, buffers.terminated, buffers.truncated, world._over, world._tally,
            )  # fmt: skip
            seen |= {fate for m, fate in info["snake_info"].items() if alive[m]}
            for m, snake in enumerate(gym.snakes):
                row = world.snakes[0, m]
                body = [tuple(map(int, square)) for square in world.bodies[0, m, : row[pack.LENGTH]]]
                assert body == snake.body
                assert bool(row[pack.ALIVE]) == snake.alive == (not dones[m])
                dies = alive[m] and not snake.alive
                # The pack pays a death when the game ends, we when it happens.
                theirs = paid[m] - (PAID_AT_DEATH if over and not snake.alive else 0.0)
                assert buffers.reward[0, m] - (PAID_AT_DEATH if dies else 0.0) == pytest.approx(theirs)
                if snake.alive:
                    assert (row[pack.HEALTH], row[pack.FED], row[pack.AGE]) == (snake.health, snake.fed, snake.turns)
            mine = {tuple(map(int, square)) for square in np.argwhere(world.food[0])}
            assert gym.food <= mine
            assert len(mine - gym.food) <= 1
            assert world._over[0] == over
            assert world.turns[0] == gym.turn
            if over:
                break
            world._observe(buffers)
    assert len(seen) >= 6, seen


def test_the_experiments_worlds_have_masks_where_their_names_say_so():
    assert MaskedExactGames(1).spec.has_action_mask
    assert not ExactGames(1).spec.has_action_mask
    assert MaskedStarterPackGames(1).spec.has_action_mask
    assert not StarterPackWorld(1).spec.has_action_mask


def test_what_learns_by_the_official_rules_is_shown_the_outlook_where_it_has_a_mask():
    assert "outlook" in MaskedExactGames(1).spec.observations
    assert "outlook" not in ExactGames(1).spec.observations


@pytest.mark.parametrize("words", [{"side": 2}, {"snakes": 17}, {"num_worlds": 0}])
def test_impossible_games_are_refused(words):
    said = "0 games of 5 snakes on 11x11, cut after 1000; " if "num_worlds" in words else ""
    with pytest.raises(BoardError, match=f"{said}expected at least 1"):
        StarterPackWorld(**{"num_worlds": 1, **words})


def test_no_two_snakes_begin_on_one_square_however_many_games_were_played_before():
    world = StarterPackWorld(40, side=7, max_turns=3)
    buffers, rng = allocate(world.spec), np.random.default_rng(1)
    world.reset(buffers, 4)
    begun = 0
    for _ in range(30):
        world.step(rng.integers(0, 4, buffers.reward.shape), buffers)
        for game in np.flatnonzero(world.turns == 0):
            squares = world.bodies[game, :, 0].tolist()
            assert len({tuple(square) for square in squares}) == len(squares)
            begun += 1
    assert begun > 200


@pytest.mark.parametrize(
    ("masked", "length", "reward"), [(False, (3.6, 5.2), (-2.6, -1.2)), (True, (85, 120), (12.5, 19.5))]
)
def test_random_snakes_last_as_long_as_in_the_original(masked, length, reward):
    """Facts D.3, 11 x 11, 5 snakes: 4.4 turns and -1.9 for uniform moves; 102 and 15.8 for safe ones."""
    games = 300
    world = StarterPackWorld(games, is_masked=True)
    buffers, rng = allocate(world.spec), np.random.default_rng(0)
    world.reset(buffers, 2)
    turns, paid, playing = np.zeros(games), np.zeros(games), np.ones(games, bool)
    while playing.any():
        liking = rng.random((games, 5, 4)) * (buffers.action_mask if masked else 1.0)
        world.step(liking.argmax(axis=-1), buffers)
        turns += playing
        paid += playing * buffers.reward.sum(axis=1)
        playing &= ~world._over
    assert length[0] < turns.mean() < length[1]
    assert reward[0] < paid.mean() < reward[1]
