"""Battlesnake as `gymnasium.Env`: one snake that learns, against built-in players.

`import racecraft.adapters`, then `gymnasium.make("racecraft/Battlesnake-v0")`, or `gymnasium.make_vec` with
`vectorization_mode="vector_entry_point"` for many games in one call.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from racecraft.adapters.gymnasium_env import WorldEnv
from racecraft.adapters.gymnasium_vector import WorldVectorEnv
from racecraft.contract.errors import SettingError, nearest
from racecraft.worlds.battlesnake.env.board import draw
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import RewardWeights, WorldSettings
from racecraft.worlds.battlesnake.players.one_seat import OneSeatWorld, seats_for


class SnakeEnv(WorldEnv):
    """One snake at a board under the official rules; the others are players of ours.

    Observation: a dictionary of `planes` uint8 (8, V, V), `numbers` float32 (6,) and, with `outlook`, `outlook`
    float32 (4, 10); see `env/observation.py`. Action: 0 up, 1 down, 2 left, 3 right;
    `info["action_mask"]` tells which are not surely fatal. An episode ends with the snake's death or the game
    (`terminated`), or after `max_turns` (`truncated`). Reward: 1 for a win, -1 for a death, unless `prizes` says more.

    Args:
        opponents: Who sits at the other seats: names of built-in players, a FILE.py, the RUN of a training; () to play
            alone. `random_safe`, `hungry` and `flood_fill` are compiled and cost next to nothing.
        snakes: Snakes in a game; the opponents are repeated in turn until there are so many. None: as many as named.
        width: Squares from left to right, 3 to 25; so is `height`, from bottom to top.
        height: See above.
        ruleset: standard, solo, royale, constrictor, wrapped, wrapped_constrictor.
        map: Name of a map.
        max_turns: A game that lasts longer is cut.
        view: Side of the window about the head in squares, odd; None: the whole board from anywhere, at most 21.
        outlook: Whether the snake is told what lies behind each of its moves, too.
        prizes: What is paid: `turn`, `food`, `kill`, `win`, `loss`.
        render_mode: "ansi" for the board as text.
    """

    metadata = {"render_modes": ["ansi"], "render_fps": 8}  # noqa: RUF012

    def __init__(self, render_mode: str | None = None, **options: Any) -> None:
        if render_mode not in (None, "ansi"):
            raise SettingError("render_mode is {render_mode!r}; expected None or 'ansi'.", render_mode=render_mode)
        self.games = one_seat_world(1, **options)
        super().__init__(self.games)
        self.render_mode = render_mode

    def render(self) -> str | None:
        """Return the board as text, the learner as A; None without a render mode."""
        return draw(self.games.board(0)) if self.render_mode == "ansi" else None


def snake_vector_env(num_envs: int = 1, **options: Any) -> WorldVectorEnv:
    """Return many games in one vector environment; options as for `SnakeEnv`."""
    options.pop("render_mode", None)
    return WorldVectorEnv(one_seat_world(num_envs, **options))


def one_seat_world(
    num_games: int,
    opponents: str | Sequence[str] = "flood_fill",
    snakes: int | None = None,
    width: int = 11,
    height: int = 11,
    ruleset: str = "standard",
    map: str = "standard",
    max_turns: int = 500,
    view: int | None = None,
    outlook: bool = False,
    prizes: RewardWeights | Mapping[str, float] | None = None,
) -> OneSeatWorld:
    """Return N games of one learner as a world; arguments as for `SnakeEnv`."""
    game = GameSettings(width, height, 1, ruleset, map)
    paid = prizes if isinstance(prizes, RewardWeights) else _prizes(prizes or {})
    settings = WorldSettings(game, num_games, max_turns, view, outlook, paid)
    return OneSeatWorld(settings, seats_for(opponents, snakes))


def _prizes(values: Mapping[str, float]) -> RewardWeights:
    known = asdict(RewardWeights())
    for name in values:
        if name not in known:
            raise SettingError("There is no prize '{name}'. {hint}", name=name, hint=nearest(name, known))
    return RewardWeights(**{**known, **values})
