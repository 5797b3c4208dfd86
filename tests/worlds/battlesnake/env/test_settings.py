"""Settings that no game can be played with are refused, and those at the very border are not."""

from dataclasses import asdict

import pytest

from racecraft.contract.errors import SettingError
from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.settings import GameSettings, SnakeConfig

BORDERS = {"width": (3, 25), "hazard_damage": (-100, 100)}


@pytest.mark.parametrize("name", BORDERS)
def test_a_game_is_played_up_to_its_borders_and_not_beyond(name):
    low, high = BORDERS[name]
    for fine in (low, high):
        assert getattr(GameSettings(**{name: fine}), name) == fine
    for beyond in (low - 1, high + 1):
        with pytest.raises(BoardError, match=f"{name} is {beyond}; expected {low} to {high}"):
            GameSettings(**{name: beyond})


def test_a_snake_sees_an_odd_number_of_squares():
    assert [SnakeConfig(view=view).view for view in (3, 11, 49)] == [3, 11, 49]
    for view in (4, 12):
        with pytest.raises(SettingError, match=f"snake.view is {view}; expected an odd number"):
            SnakeConfig(view=view)


def test_a_game_of_which_nothing_is_told_is_the_official_command_lines():
    """Facts A.11: `battlesnake play` without a word."""
    assert asdict(GameSettings()) == {
        "width": 11, "height": 11, "players": 4, "ruleset": "standard", "map": "standard", "food_spawn_chance": 15,
        "minimum_food": 1, "hazard_damage": 14, "shrink_every": 25, "solo": None,
    }  # fmt: skip
    assert GameSettings(7, 9).area == 63
