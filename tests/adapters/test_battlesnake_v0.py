"""Battlesnake by PettingZoo's way of naming."""

import pytest

from racecraft.contract.errors import SettingError
from racecraft.worlds.battlesnake import adapter as battlesnake_v0
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import RewardWeights, WorldSettings

pytest.importorskip("pettingzoo")


def test_what_is_told_of_a_game_is_what_is_played():
    env = battlesnake_v0.parallel_env(7, 9, 2, "wrapped", "empty", 30, 5, True, {"food": 0.5, "loss": -3})
    game, prizes = GameSettings(7, 9, 2, "wrapped", "empty"), RewardWeights(food=0.5, loss=-3)
    assert env.world.settings == WorldSettings(game, 1, 30, 5, True, prizes)
    turns = battlesnake_v0.env(width=7, height=7, snakes=2)
    turns.reset(seed=1)
    assert turns.agent_selection == "agent_0"


def test_a_prize_that_nobody_pays_is_refused():
    with pytest.raises(SettingError, match="There is no prize 'foot'. Did you mean 'food'"):
        battlesnake_v0.parallel_env(prizes={"foot": 1})
