"""Many games at once: places and moves by hand, and what is shown to whom."""

from types import SimpleNamespace

import pytest

from racecraft.contract.world import EpisodeRecord
from racecraft.evaluation.rating import Result
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import WorldSettings
from racecraft.worlds.battlesnake.evaluation import batch
from racecraft.worlds.battlesnake.evaluation.batch import play_batch

SETTINGS = WorldSettings(GameSettings(7, 7, 4), view=9, outlook=True)


@pytest.fixture
def told(monkeypatch):
    """What a world was made with, and who sat where; `records` is what its episodes came to."""
    told = SimpleNamespace(records=[], closed=0)

    class World:
        def __init__(self, settings):
            told.settings = settings

        def close(self):
            told.closed += 1

    def seated(players, sitting, world, seed):
        told.sitting, told.seat_seed = sitting.tolist(), seed
        return "seated"

    def play(policy, world, seed):
        told.seed = policy, seed
        return told.records

    monkeypatch.setattr(batch, "BattlesnakeWorld", World)
    monkeypatch.setattr(batch, "SeatedPlayers", seated)
    monkeypatch.setattr(batch, "play_episodes", play)
    return told


def test_who_lives_stands_before_who_left_and_who_lasted_longer_before_who_did_not(told):
    """Two games of three: in the second everyone sits one seat further on."""
    ends = [("won", 10), ("hazard", 4), ("hazard", 4), ("snake-collision", 9), ("truncated", 12), ("truncated", 12)]
    told.records = [EpisodeRecord(n // 3, n % 3, steps, 0.0, how) for n, (how, steps) in enumerate(ends)]
    results = play_batch(["a policy", "hungry", "hungry"], SETTINGS, 2, 5)
    assert told.sitting == [[0, 1, 2], [1, 2, 0]]
    assert results == [Result((0, 1, 2), (0, 1, 1)), Result((0, 1, 2), (0, 2, 0))]
    assert [one.steps for one in results] == [18, 33], "moves of all together"
    assert (told.seat_seed, told.seed, told.closed) == (5, ("seated", 5), 1)


def test_the_world_has_as_many_snakes_as_players_and_a_game_a_thousand_turns(told):
    told.records = [EpisodeRecord(0, n, 1, 0.0, "won") for n in range(2)]
    play_batch([object(), "hungry"], SETTINGS, 1, 5)
    made = told.settings
    assert (made.game.players, made.num_games, made.max_turns) == (2, 1, 1000)
    assert (made.view, made.outlook) == (9, True), "a policy sees what it is used to"
    play_batch(["hungry", "hungry"], SETTINGS, 1, 5, most_turns=7)
    made = told.settings
    assert (made.max_turns, made.view, made.outlook) == (7, 3, False), "anchors see the board itself"
