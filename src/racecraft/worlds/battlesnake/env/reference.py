"""The referee: one game, slow and readable. The kernels play the same game, roll for roll (`kernels/rules.py`).

::

    referee = Referee(GameSettings(ruleset="royale"), StreamDice(key))
    while not referee.over:
        referee.turn({snake.id: "up" for snake in referee.board.alive()})
"""

from __future__ import annotations

from racecraft.worlds.battlesnake.env import maps
from racecraft.worlds.battlesnake.env.board import Board
from racecraft.worlds.battlesnake.env.dice import Dice
from racecraft.worlds.battlesnake.env.rulesets import Ruleset, find_ruleset, is_over
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import GameContext, Moves


class Referee:
    """One game from set-up to its end.

    Args:
        settings: What is played; names are checked here.
        dice: All chance of the game.
    """

    def __init__(self, settings: GameSettings, dice: Dice) -> None:
        self.settings, self.dice = settings, dice
        self.rules: Ruleset = find_ruleset(settings.ruleset)
        self.board, self.map_state = maps.set_up(settings, dice)
        self.table = GameContext(settings, self.map_state.sides)
        apply_rules(self.rules, self.board, None, self.table)

    @property
    def over(self) -> bool:
        """Whether the position at hand ends the game."""
        return is_over(self.board, self.settings)

    def turn(self, moves: Moves) -> Board:
        """Play one turn: the rules, then the map, then the count. A finished game stays as it is.

        Args:
            moves: A move for every living snake's id; a word that is no move means straight on.

        Returns:
            The new position, which is also `self.board`; the old one is left untouched.
        """
        if self.over:
            return self.board
        board = self.board.copy()
        apply_rules(self.rules, board, moves, self.table)
        maps.after_turn(board, self.settings, self.map_state, self.dice)
        board.turn += 1
        self.board = board
        return board


def apply_rules(rules: Ruleset, board: Board, moves: Moves | None, table: GameContext) -> None:
    """Walk a ruleset's stages in place; `moves` is None at set-up, where most stages do nothing."""
    for stage in rules.stages:
        stage(board, moves, table)
