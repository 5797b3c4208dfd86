"""Loops over games `first` to `beyond` - 1: what `world.py` and the benchmarks call.

Each game writes only its own rows and no call holds Python's lock, so that threads may share the games; `prange` would
do the same and compile several times as long.

`random_safe_play` is the yardstick: whole games with random safe moves, set-up and end included.
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import inner_kernel, lean_kernel
from racecraft.worlds.battlesnake.env.kernels.begin import begin_standard
from racecraft.worlds.battlesnake.env.kernels.columns import (
    ALIVE,
    BODY,
    BY,
    CAUSE,
    CONSTRICTOR,
    HEAD,
    LENGTH,
    ON,
    SOLO,
    TURN,
)
from racecraft.worlds.battlesnake.env.kernels.food_and_hazards import below
from racecraft.worlds.battlesnake.env.kernels.observe import allow, count, holds_board, mark, observe
from racecraft.worlds.battlesnake.env.kernels.outlook import outlook_game
from racecraft.worlds.battlesnake.env.kernels.planes import draw, lay_down
from racecraft.worlds.battlesnake.env.kernels.rules import play_turn


@lean_kernel
def step_games(
    first, beyond, begins, looks_behind, actions, bodies, snakes, games, cells, sides, events, chance, params,
    food_squares, start_hazards, squares, marks, sheets, walls, looks, scratch, prizes, max_turns, reward, terminated,
    truncated, over, tally, last_snakes, last_games, last_tally, planes, numbers, outlook, active, mask,
    final_planes, final_numbers, final_outlook, no_active, no_mask,
):  # fmt: skip
    """Play one turn of every game, pay it out, and show what follows: game by game, while it lies in the cache.

    Args:
        first: First game.
        beyond: The game after the last.
        begins: Whether games that are over begin anew (`begin_standard`) and show their start; else they are left as
            they ended, for the referee to set up.
        looks_behind: Whether the outlook is shown, too; if not, `looks`, `scratch`, `outlook` and `final_outlook` may
            be of any size.
        actions: int64 (N, M).
        bodies: The arrays of `state.Games`, to `chance`.
        snakes: See above.
        games: See above.
        cells: See above.
        sides: See above.
        events: See above.
        chance: See above.
        params: See `columns.py`, as is `food_squares`.
        food_squares: See above.
        start_hazards: See `begin_standard`.
        squares: See `observe_games`, as are `marks`, `sheets` and `walls`.
        marks: See above.
        sheets: See above.
        walls: See above.
        looks: See `outlook_games`, as is `scratch`.
        scratch: See above.
        prizes: float32 (5,): for a turn survived, a food eaten, a kill, the win, the loss.
        max_turns: A game that lasts so long is cut; 0 never.
        reward: float32 (N, M), written, as are `terminated`, `truncated` bool (N, M) and `over` bool (N,).
        terminated: See above.
        truncated: See above.
        over: See above.
        tally: float64 (N, M, 3), added to: rewards, foods, kills of the episode.
        last_snakes: int32 (N, M, 10): the rows of `snakes` at the end of the episodes that ended; so are `last_games`
            (N, M, 4), of `games`, and `last_tally` (N, M, 3).
        last_games: See above.
        last_tally: See above.
        planes: The observation; see `observe_games`, to `mask`.
        numbers: See above.
        outlook: See `outlook_games`.
        active: See above.
        mask: See above.
        final_planes: The last observation of games that are over, as are the next two.
        final_numbers: See above.
        final_outlook: See above.
        no_active: Written and of no use, as is `no_mask`.
        no_mask: See above.
    """
    for g in range(first, beyond):
        _play_and_pay(
            g, actions, bodies, snakes, games, cells, sides, events, chance, params, food_squares,
            prizes, max_turns, reward, terminated, truncated, over, tally,
        )  # fmt: skip
        for m in range(snakes.shape[1]):
            if terminated[g, m] or truncated[g, m]:
                _copy_row(snakes[g, m], last_snakes[g, m])
                _copy_row(games[g], last_games[g, m])
                _copy_row(tally[g, m], last_tally[g, m])
        if over[g]:
            observe_game(
                g, bodies, snakes, games, cells, params, squares, marks[first], sheets[first], walls, final_planes,
                final_numbers, no_active, no_mask,
            )  # fmt: skip
            if looks_behind:
                outlook_game(g, looks, bodies, snakes, cells, params, no_mask, scratch, final_outlook)
            if not begins:
                continue
            begin_standard(g, bodies, snakes, games, cells, sides, chance, params, start_hazards)
            tally[g] = 0
        observe_game(
            g, bodies, snakes, games, cells, params, squares, marks[first], sheets[first], walls, planes, numbers,
            active, mask,
        )  # fmt: skip
        if looks_behind:
            outlook_game(g, looks, bodies, snakes, cells, params, mask, scratch, outlook)


@lean_kernel
def begin_games(first, beyond, which, bodies, snakes, games, cells, sides, chance, params, start_hazards, tally):
    """Begin the games marked in `which`, bool (N,), anew (`begin_standard`)."""
    for g in range(first, beyond):
        if which[g]:
            begin_standard(g, bodies, snakes, games, cells, sides, chance, params, start_hazards)
            tally[g] = 0


@lean_kernel
def observe_games(
    first,
    beyond,
    which,
    bodies,
    snakes,
    games,
    cells,
    params,
    squares,
    marks,
    sheets,
    walls,
    planes,
    numbers,
    active,
    mask,
):
    """Write observation, `active` and mask of every snake in the games marked in `which`.

    `planes` uint8 (N, M, 8, V, V), `numbers` float32 (N, M, 6), `active` bool (N, M), `mask` bool (N, M, 4). `marks` is
    room for (N, K, 2) and `sheets` for (N, L) (`sheet.draw`), of which a call uses its first game's.
    """
    for g in range(first, beyond):
        if which[g]:
            observe_game(
                g, bodies, snakes, games, cells, params, squares, marks[first], sheets[first], walls, planes, numbers,
                active, mask,
            )  # fmt: skip


@lean_kernel
def observe_game(g, bodies, snakes, games, cells, params, squares, marks, sheet, walls, planes, numbers, active, mask):
    """Write observation, `active` and mask of every snake of game g; for `marks` see `observe.mark`."""
    _observe(g, bodies, snakes, games, cells, params, squares, marks, sheet, walls, planes, numbers, active, mask)


@inner_kernel
def _observe(g, bodies, snakes, games, cells, params, squares, marks, sheet, walls, planes, numbers, active, mask):
    side = planes.shape[3]
    count(g, snakes, games, params, numbers)
    for m in range(snakes.shape[1]):
        allow(g, m, bodies, snakes, cells, params, mask)
        active[g, m] = snakes[g, m, CAUSE] == 0
    if holds_board(side, params):
        draw(g, bodies, snakes, games, cells, params, squares, side, sheet)
        seen = planes[g].reshape((snakes.shape[1], -1))
        for m in range(snakes.shape[1]):
            lay_down(g, m, bodies, snakes, params, squares, side, sheet, walls, seen[m])
        return
    planes[g].reshape(-1)[:] = 0
    mark(g, bodies, snakes, games, cells, params, squares, marks)
    for m in range(snakes.shape[1]):
        observe(g, m, snakes, params, marks, walls, planes)


@lean_kernel
def random_safe_play(
    turns, bodies, snakes, games, cells, sides, events, chance, params, food_squares, start_hazards, moves, mask
):
    """Let one game after the other play `turns` turns of random safe moves, beginning anew at each end."""
    for g in range(bodies.shape[0]):
        for _ in range(turns):
            for m in range(snakes.shape[1]):
                if snakes[g, m, CAUSE] == 0:
                    allow(g, m, bodies, snakes, cells, params, mask)
                    to_up = np.int64(mask[g, m, 0])
                    to_down = to_up + np.int64(mask[g, m, 1])
                    to_left = to_down + np.int64(mask[g, m, 2])
                    drawn = below(g, chance, to_left + np.int64(mask[g, m, 3]))
                    moves[g, m] = (drawn >= to_up) + (drawn >= to_down) + (drawn >= to_left)
            play_turn(g, moves, bodies, snakes, games, cells, sides, events, chance, params, food_squares)
            if games[g, ALIVE] <= (0 if params[SOLO] else 1):
                begin_standard(g, bodies, snakes, games, cells, sides, chance, params, start_hazards)


@inner_kernel
def _play_and_pay(
    g, moves, bodies, snakes, games, cells, sides, events, chance, params, food_squares,
    prizes, max_turns, reward, terminated, truncated, over, tally,
):  # fmt: skip
    turn, alive = games[g, TURN] + 1, games[g, ALIVE]
    for m in range(snakes.shape[1]):
        reward[g, m] = -np.float32(snakes[g, m, LENGTH])
    play_turn(g, moves, bodies, snakes, games, cells, sides, events, chance, params, food_squares)
    ended = games[g, ALIVE] <= (0 if params[SOLO] else 1)
    cut = max_turns > 0 and turn >= max_turns and not ended
    over[g] = ended or cut
    for m in range(snakes.shape[1]):
        out = snakes[g, m, CAUSE] != 0
        if out and snakes[g, m, ON] != turn:
            reward[g, m], terminated[g, m], truncated[g, m] = 0.0, False, False
            continue
        ate = reward[g, m] + snakes[g, m, LENGTH] > 0 and not params[CONSTRICTOR]
        kills = _kills(g, m, turn, snakes) if games[g, ALIVE] < alive else 0
        pay = prizes[4] if out else prizes[3] if ended and not params[SOLO] else prizes[0]
        reward[g, m] = pay + ate * prizes[1] + kills * prizes[2]
        terminated[g, m], truncated[g, m] = out or ended, cut and not out
        tally[g, m, 0] += reward[g, m]
        tally[g, m, 1] += ate
        tally[g, m, 2] += kills


@inner_kernel
def _copy_row(source, target):
    for column in range(target.size):
        target[column] = source[column]


@inner_kernel
def _kills(g, m, turn, snakes):
    """Count the others that snake m eliminated in this turn."""
    kills = 0
    for other in range(snakes.shape[1]):
        row = snakes[g, other]
        by_collision = row[CAUSE] == BODY or row[CAUSE] == HEAD
        kills += other != m and by_collision and row[BY] == m and row[ON] == turn
    return kills
