"""Settings that no game can be played with are refused, and those at the very border are not."""

import pytest

from racecraft.contract.errors import SettingError
from racecraft.envs.battlesnake.board import BoardError
from racecraft.envs.battlesnake.settings import GameSettings, SnakeConfig

BORDERS = {
    "width": (3, 25),
    "height": (3, 25),
    "players": (1, 16),
    "food_spawn_chance": (0, 100),
    "minimum_food": (0, 121),
    "hazard_damage": (-100, 100),
    "shrink_every": (0, 1_000_000),
}


@pytest.mark.parametrize("name", BORDERS)
def test_a_game_is_played_up_to_its_borders_and_not_beyond(name):
    low, high = BORDERS[name]
    for fine in (low, high):
        assert getattr(GameSettings(**{"minimum_food": 0, name: fine}), name) == fine
    for beyond in (low - 1, high + 1):
        with pytest.raises(BoardError, match=f"{name} is {beyond}; expected {low} to {high}"):
            GameSettings(**{name: beyond})


def test_a_snake_sees_an_odd_number_of_squares():
    assert [SnakeConfig(view=view).view for view in (3, 11, 49)] == [3, 11, 49]
    for view in (4, 12):
        with pytest.raises(SettingError, match=f"snake.view is {view}; expected an odd number"):
            SnakeConfig(view=view)
