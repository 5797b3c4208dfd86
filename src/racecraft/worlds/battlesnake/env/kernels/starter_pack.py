"""The starter pack's rules for many games at once: the compiled twin of `starter_pack.py`. Begin with `play_turns`.

State, N games of M snakes on R rows and C columns:

    bodies   int16 (N, M, R * C + 2, 2)  (row, column) from head to tail; only the first LENGTH squares mean something
    snakes   int64 (N, M, COLUMNS)       see the columns below; a dead snake has LENGTH 0
    food     bool (N, R, C)
    turns    int64 (N,)
    chance   uint64 (N, 2)               key and counter of each game's stream
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import kernel
from racecraft.worlds.battlesnake.env.kernels.food_and_hazards import below

LENGTH, HEALTH, FACING, ALIVE, AGE, STACKED, FED, FATE = range(8)
"""Columns of `snakes`: squares; 1 to 100; the last move or -1; 0 or 1; turns survived; moves on which the tail stays
yet; whether it stays on the next one because of a meal; how the turn went for it."""
COLUMNS = 8

FREE, HIT_WALL, EATEN, HIT_SELF, HIT_OTHER, WAS_HIT, ATE, STARVED, FORBIDDEN = range(9)
"""Fates. They are indices of prices, too; ATE_FOOD, ANOTHER_TURN, WON and DIED come behind them."""
ATE_FOOD, ANOTHER_TURN, WON, DIED = range(9, 13)
PRICES = 13

HEALTHY, START_STACKED, FOOD_IN_HUNDRED = 100, 2, 15
WINDOW, ALL_ROUND = 21, 10
"""Side of what a snake sees, and how far that reaches from its middle."""
HEAD, BODY, OUTSIDE = 5, 1, -1
"""What stands in the planes."""


@kernel
def begin_games(which, bodies, snakes, food, turns, chance):
    """Begin the games marked in `which`, bool (N,), anew: snakes of one square anywhere, and one food."""
    count, rows, columns = snakes.shape[1], food.shape[1], food.shape[2]
    for g in range(len(which)):
        if not which[g]:
            continue
        turns[g] = 0
        food[g] = False
        snakes[g] = 0
        for m in range(count):
            taken = True
            while taken:
                square = below(g, chance, rows * columns)
                row, column = square // columns, square % columns
                taken = False
                for other in range(m):
                    taken |= bodies[g, other, 0, 0] == row and bodies[g, other, 0, 1] == column
            bodies[g, m, 0, 0], bodies[g, m, 0, 1] = row, column
            snakes[g, m, LENGTH], snakes[g, m, HEALTH], snakes[g, m, FACING] = 1, HEALTHY, -1
            snakes[g, m, ALIVE], snakes[g, m, STACKED] = 1, START_STACKED
        drop_food(g, bodies, snakes, food, chance)


@kernel
def play_turns(
    moves, bodies, snakes, food, turns, chance, prices, max_turns, reward, terminated, truncated, over, tally
):
    """Play one turn of every game and pay it out.

    Args:
        moves: int64 (N, M): 0 up (row - 1), 1 down, 2 left, 3 right.
        bodies: See above, to `chance`.
        snakes: See above.
        food: See above.
        turns: See above.
        chance: See above.
        prices: float32 (PRICES,).
        max_turns: A game that lasts so long is cut; 0 never.
        reward: float32 (N, M), written, as are `terminated`, `truncated` bool (N, M) and `over` bool (N,).
        terminated: See above.
        truncated: See above.
        over: See above.
        tally: float64 (N, M), added to: the rewards of the episode.
    """
    for g in range(len(turns)):
        reward[g], terminated[g], truncated[g] = 0.0, False, False
        _play_turn(g, moves, bodies, snakes, food, prices, reward, terminated)
        if below(g, chance, 100) < FOOD_IN_HUNDRED:
            drop_food(g, bodies, snakes, food, chance)
        turns[g] += 1
        _end(g, snakes, turns, prices, max_turns, reward, terminated, truncated, over)
        for m in range(snakes.shape[1]):
            tally[g, m] += reward[g, m]


@kernel
def _play_turn(g, moves, bodies, snakes, food, prices, reward, terminated):
    """Let every living snake hunger and move, look at every head in turn, and let all die together that must."""
    count, rows, columns = snakes.shape[1], food.shape[1], food.shape[2]
    for m in range(count):
        snakes[g, m, FATE] = FREE
        if snakes[g, m, ALIVE]:
            snakes[g, m, HEALTH] -= 1
            if snakes[g, m, HEALTH] == 0:
                _die(g, m, STARVED, snakes, prices, reward, terminated)
            elif _move(g, m, moves[g, m], bodies, snakes):
                _die(g, m, FORBIDDEN, snakes, prices, reward, terminated)
    for m in range(count):
        if not snakes[g, m, ALIVE]:
            continue
        fate = outcome(g, m, bodies, snakes, rows, columns)
        snakes[g, m, FATE] = fate
        if fate < HIT_WALL or fate > HIT_OTHER:
            row, column = bodies[g, m, 0]
            if food[g, row, column]:
                food[g, row, column] = False
                snakes[g, m, FED], snakes[g, m, HEALTH] = 1, HEALTHY
                reward[g, m] += prices[ATE_FOOD]
            reward[g, m] += prices[fate] if fate != FREE else 0.0
    for m in range(count):
        fate = snakes[g, m, FATE]
        if snakes[g, m, ALIVE] and HIT_WALL <= fate <= HIT_OTHER:
            _die(g, m, fate, snakes, prices, reward, terminated)
        elif snakes[g, m, ALIVE]:
            snakes[g, m, AGE] += 1
            reward[g, m] += prices[ANOTHER_TURN]


@kernel
def _die(g, m, fate, snakes, prices, reward, terminated):
    """Let a snake leave the board, with the price of its fate and of having died."""
    snakes[g, m, ALIVE], snakes[g, m, LENGTH], snakes[g, m, FATE] = 0, 0, fate
    reward[g, m] += prices[fate] + prices[DIED]
    terminated[g, m] = True


@kernel
def _end(g, snakes, turns, prices, max_turns, reward, terminated, truncated, over):
    """Tell whether the game is over: one snake left, or its time."""
    count, living = snakes.shape[1], 0
    for m in range(count):
        living += snakes[g, m, ALIVE]
    finished = living <= (1 if count > 1 else 0)
    cut = not finished and max_turns > 0 and turns[g] >= max_turns
    over[g] = finished or cut
    for m in range(count):
        if snakes[g, m, ALIVE] and finished:
            reward[g, m] += prices[WON]
            terminated[g, m] = True
        elif snakes[g, m, ALIVE] and cut:
            truncated[g, m] = True


@kernel
def _move(g, m, action, bodies, snakes):
    """Move one square; tell whether it was straight back, which goes straight on."""
    facing = snakes[g, m, FACING]
    forbidden = facing >= 0 and action == facing ^ 1
    if not forbidden:
        snakes[g, m, FACING] = action
    row_step, column_step = step_of(snakes[g, m, FACING])
    length = snakes[g, m, LENGTH]
    keeps_tail = snakes[g, m, STACKED] > 0 or snakes[g, m, FED] == 1
    if snakes[g, m, STACKED] > 0:
        snakes[g, m, STACKED] -= 1
    else:
        snakes[g, m, FED] = 0
    for place in range(length if keeps_tail else length - 1, 0, -1):
        bodies[g, m, place] = bodies[g, m, place - 1]
    snakes[g, m, LENGTH] = length + (1 if keeps_tail else 0)
    bodies[g, m, 0, 0] += row_step
    bodies[g, m, 0, 1] += column_step
    return forbidden


@kernel
def step_of(action):
    """Return the rows and columns of a move."""
    if action < 2:
        return (-1 if action == 0 else 1), 0
    return 0, (-1 if action == 2 else 1)


@kernel
def outcome(g, m, bodies, snakes, rows, columns):
    """Return what a living snake's head met after all have moved; snakes before it in the list were looked at."""
    count = snakes.shape[1]
    row, column = bodies[g, m, 0]
    if not _on_board(row, column, rows, columns):
        return HIT_WALL
    own_row_step, own_column_step = step_of(snakes[g, m, FACING])
    eaten = 0
    for swapped in range(2):
        for other in range(count):
            if other == m or not snakes[g, other, ALIVE]:
                continue
            head = bodies[g, other, 0]
            if swapped:
                row_step, column_step = step_of(snakes[g, other, FACING])
                meets = row == head[0] - row_step and column == head[1] - column_step
                meets &= head[0] == row - own_row_step and head[1] == column - own_column_step
            else:
                meets = head[0] == row and head[1] == column
            if meets:
                if snakes[g, other, LENGTH] >= snakes[g, m, LENGTH]:
                    return EATEN
                eaten |= 1 << other
    if _in_body(g, m, row, column, bodies, snakes):
        return HIT_SELF
    blocking = 0
    for other in range(count):
        if other != m and snakes[g, other, ALIVE] and not eaten >> other & 1:
            head = bodies[g, other, 0]
            if _on_board(head[0], head[1], rows, columns):
                blocking += _in_body(g, other, row, column, bodies, snakes)
    if blocking == 1:
        return HIT_OTHER
    for other in range(count):
        doomed = other < m and HIT_WALL <= snakes[g, other, FATE] <= HIT_OTHER
        if other != m and snakes[g, other, ALIVE] and not doomed:
            head = bodies[g, other, 0]
            if _in_body(g, m, head[0], head[1], bodies, snakes):
                return WAS_HIT
    return ATE if eaten else FREE


@kernel
def _on_board(row, column, rows, columns):
    return 0 <= row < rows and 0 <= column < columns


@kernel
def _in_body(g, m, row, column, bodies, snakes):
    """Tell whether a square is one of a snake's, its head left out."""
    for place in range(1, snakes[g, m, LENGTH]):
        if bodies[g, m, place, 0] == row and bodies[g, m, place, 1] == column:
            return True
    return False


@kernel
def drop_food(g, bodies, snakes, food, chance):
    """Let a food fall where no snake lies; one that falls on another is lost."""
    rows, columns = food.shape[1], food.shape[2]
    taken = np.zeros((rows, columns), np.bool_)
    free = rows * columns
    for m in range(snakes.shape[1]):
        for place in range(snakes[g, m, LENGTH]):
            row, column = bodies[g, m, place]
            if _on_board(row, column, rows, columns) and not taken[row, column]:
                taken[row, column] = True
                free -= 1
    if free == 0:
        return
    at = below(g, chance, free)
    for row in range(rows):
        for column in range(columns):
            if not taken[row, column]:
                if at == 0:
                    food[g, row, column] = True
                at -= 1


@kernel
def observe_games(which, bodies, snakes, food, centred, planes, active, mask):
    """Write what every snake of the games marked in `which` sees.

    Args:
        which: bool (N,).
        bodies: See above, to `food`.
        snakes: See above.
        food: See above.
        centred: Whether a snake's head is the middle of what it sees; else the board is.
        planes: int8 (N, M, WINDOW, WINDOW, 3): food 1; itself: head 5, body 1; the sum of the others likewise. What is
            no board is -1 for each snake of the sum. A dead snake's are 0.
        active: bool (N, M): it lives.
        mask: bool (N, M, 4): moves that neither turn back nor meet a wall or a body; all where there is none. A tail
            that moves on is no body.
    """
    rows, columns = food.shape[1], food.shape[2]
    count = snakes.shape[1]
    blocked = np.zeros((rows, columns), np.bool_)
    for g in range(len(which)):
        if not which[g]:
            continue
        _block(g, bodies, snakes, blocked)
        for m in range(count):
            active[g, m] = snakes[g, m, ALIVE] == 1
            planes[g, m] = 0
            mask[g, m] = True
            if active[g, m]:
                top, left = (WINDOW - rows) // 2, (WINDOW - rows) // 2
                if centred:
                    top, left = ALL_ROUND - bodies[g, m, 0, 0], ALL_ROUND - bodies[g, m, 0, 1]
                _show(g, m, top, left, bodies, snakes, food, planes[g, m])
                _allow(g, m, bodies, snakes, blocked, mask[g, m])


@kernel
def _show(g, m, top, left, bodies, snakes, food, planes):
    """Write what one snake sees; square (0, 0) of the board stands at (top, left)."""
    rows, columns, count = food.shape[1], food.shape[2], snakes.shape[1]
    for row in range(WINDOW):
        for column in range(WINDOW):
            if not _on_board(row - top, column - left, rows, columns):
                planes[row, column, 0], planes[row, column, 1] = OUTSIDE, OUTSIDE
                planes[row, column, 2] = OUTSIDE * (count - 1)
            elif food[g, row - top, column - left]:
                planes[row, column, 0] = 1
    for other in range(count):
        channel = 1 if other == m else 2
        for place in range(snakes[g, other, LENGTH] - 1, -1, -1):
            row, column = bodies[g, other, place, 0] + top, bodies[g, other, place, 1] + left
            if 0 <= row < WINDOW and 0 <= column < WINDOW:
                if place == 0:
                    planes[row, column, channel] += HEAD - (planes[row, column, channel] if channel == 1 else 0)
                elif channel == 2 or planes[row, column, channel] == 0:
                    planes[row, column, channel] += BODY


@kernel
def _block(g, bodies, snakes, blocked):
    """Mark the squares that no head should go to."""
    blocked[:] = False
    for m in range(snakes.shape[1]):
        stays = snakes[g, m, STACKED] > 0 or snakes[g, m, FED] == 1
        for place in range(snakes[g, m, LENGTH] if stays else snakes[g, m, LENGTH] - 1):
            blocked[bodies[g, m, place, 0], bodies[g, m, place, 1]] = True


@kernel
def _allow(g, m, bodies, snakes, blocked, mask):
    """Write which moves neither turn back nor meet a wall or a body; all where there is none."""
    rows, columns = blocked.shape
    facing, found = snakes[g, m, FACING], False
    for action in range(4):
        row_step, column_step = step_of(action)
        row, column = bodies[g, m, 0, 0] + row_step, bodies[g, m, 0, 1] + column_step
        back = facing >= 0 and action == facing ^ 1
        mask[action] = not back and _on_board(row, column, rows, columns) and not blocked[row, column]
        found |= mask[action]
    if not found:
        mask[:] = True
