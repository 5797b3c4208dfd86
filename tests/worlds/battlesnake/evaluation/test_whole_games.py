"""What whole games came to: means and errors by hand, first games by a world that a test writes, moves by law."""

from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.worlds.battlesnake.evaluation import whole_games
from racecraft.worlds.battlesnake.evaluation.whole_games import GameFigures, RandomMoves, play_whole_games


def test_means_come_with_their_standard_errors():
    """Four games: rewards 1, 2, 3, 6 about 3 with variance 3.5; turns 10, 10, 20, 20 about 15 with deviation 5."""
    told = GameFigures(np.array([1.0, 2.0, 3.0, 6.0]), np.array([10, 10, 20, 20])).told()
    assert told == {
        "reward": 3.0, "reward_error": pytest.approx(3.5**0.5 / 2), "length": 15.0, "length_error": pytest.approx(2.5),
    }  # fmt: skip
    assert [*told] == ["reward", "reward_error", "length", "length_error"]


def test_a_game_pays_all_its_snakes_until_the_last_has_left_and_what_follows_is_another(monkeypatch):
    ticks = [
        ([[1, 2], [0, 4]], [[0, 1], [0, 0]]),
        ([[8, 0], [0, 0]], [[0, 0], [1, 1]]),
        ([[16, 0], [32, 32]], [[1, 0], [0, 0]]),
        ([[64, 64], [64, 64]], [[0, 1], [1, 0]]),
    ]
    asked = []

    def play(policy, world, seed, observers):
        asked.append((policy, seed))
        for reward, ended in ticks:
            buffers = SimpleNamespace(reward=np.array(reward, np.float32), ended=np.array(ended, bool))
            for observer in observers:
                observer(world, buffers, None)

    monkeypatch.setattr(whole_games, "play_episodes", play)
    world = SimpleNamespace(spec=SimpleNamespace(num_worlds=2, num_agents=2))
    figures = play_whole_games("any", world, 5)
    assert asked == [("any", 5)]
    assert figures.reward.tolist() == [27.0, 4.0]
    assert figures.length.tolist() == [3, 2]
    assert figures.length.dtype == np.int64


def test_any_move_is_as_likely_and_none_that_is_forbidden():
    seen = {"board": np.zeros((4000, 3))}
    moves = RandomMoves(1).act(seen)
    counts = np.bincount(moves)
    assert len(counts) == 4
    assert (abs(counts - 1000) < 5 * np.sqrt(4000 * 0.25 * 0.75)).all()
    mask = np.tile([True, False, True, False], (4000, 1))
    allowed = np.bincount(RandomMoves(1).act(seen, mask), minlength=4)
    assert (allowed > 0).tolist() == [True, False, True, False]
    assert np.bincount(RandomMoves(1, 6).act(seen)).size == 6
    assert (RandomMoves(1).act(seen) == moves).all(), "the same seed, the same moves"
    assert (RandomMoves(2).act(seen) != moves).any()
    assert RandomMoves(1).forget(np.ones(1, bool)) is None
