"""Rulesets are lists of stages, walked in order (facts: A.2).

    standard              last snake alive wins
    solo                  one snake plays until it dies
    royale                hazards close in from the sides
    constrictor           no food; every snake grows on every turn
    wrapped               the board's edges are joined
    wrapped_constrictor   both

What the official engine does and a reader would not expect, kept here:

* The game-over test looks at the position *before* the moves. So the referee is told "over" one call late; `is_over`
  answers for the position at hand.
* Hazards bite before feeding: a snake with 1 health that steps onto food lives, on a hazard without food it dies of
  "hazard" although hunger alone would have killed it.
* Food is eaten before heads are compared: two equal snakes that meet on food both grow, and both die.
* Snakes that starve or leave the board are no obstacle in the same turn; snakes that die in a collision still are.
* The constrictor's always-grow runs at set-up and for the eliminated too. Three stacked segments do not grow; the first
  doubling comes in the second turn.
* Under royale the hazards are laid anew on every turn, so a map's own hazards vanish with the first.
* An unknown ruleset name falls back to standard in the engine; here it is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from racecraft.contract.errors import nearest
from racecraft.worlds.battlesnake.env import stages
from racecraft.worlds.battlesnake.env.board import Board, BoardError
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import Stage, at_most_one_alive, none_alive

STANDARD: tuple[Stage, ...] = (
    stages.move,
    stages.lose_health,
    stages.suffer_hazards,
    stages.feed,
    stages.eliminate,
)
WRAPPED: tuple[Stage, ...] = (stages.move_wrapped, *STANDARD[1:])
ROYALE: tuple[Stage, ...] = (*STANDARD, stages.shrink_safe_zone)
CONSTRICTOR: tuple[Stage, ...] = (*STANDARD, stages.remove_food, stages.always_grow)
WRAPPED_CONSTRICTOR: tuple[Stage, ...] = (stages.move_wrapped, *CONSTRICTOR[1:])


@dataclass(frozen=True)
class Ruleset:
    """A game: what happens in a turn, and when it is over."""

    name: str
    stages: tuple[Stage, ...]
    is_over: Callable[[Board], bool] = at_most_one_alive


RULESETS = {
    rules.name: rules
    for rules in (
        Ruleset("standard", STANDARD),
        Ruleset("solo", STANDARD, none_alive),
        Ruleset("royale", ROYALE),
        Ruleset("constrictor", CONSTRICTOR),
        Ruleset("wrapped", WRAPPED),
        Ruleset("wrapped_constrictor", WRAPPED_CONSTRICTOR),
    )
}


def find_ruleset(name: str) -> Ruleset:
    """Return a ruleset by name; an unknown name is refused with the nearest known one."""
    if name not in RULESETS:
        raise BoardError("There is no ruleset '{name}'. {hint}", name=name, hint=nearest(name, RULESETS))
    return RULESETS[name]


def is_over(board: Board, settings: GameSettings) -> bool:
    """Tell whether the game at this position is over, by the ruleset or by `settings.solo`."""
    if settings.solo is None:
        return find_ruleset(settings.ruleset).is_over(board)
    return none_alive(board) if settings.solo else at_most_one_alive(board)
