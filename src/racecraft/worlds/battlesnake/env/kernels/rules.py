"""The rules of one turn, compiled: the same acts in the same order as `reference.py`, held equal to it by test.

Begin at `play_turn`. Arrays are those of `state.Games` (columns.py names their columns); `g` is the game. Bodies are
rings of cells. Every cell knows whose living body lies on it, so that nothing here walks over bodies but a death: no
two living snakes share a cell between turns, and no snake but a stacked tail shares one with itself. A new head is
written into the cells only after the verdicts.
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import inner_kernel, lean_kernel
from racecraft.worlds.battlesnake.env.kernels.columns import (
    ALIVE,
    BODY,
    BURNT,
    BY,
    CAUSE,
    CONSTRICTOR,
    DAMAGE,
    FOOD,
    HAZARD,
    HAZARD_RULE,
    HEAD,
    HEALTH,
    HEIGHT,
    LENGTH,
    MEAL,
    NEXT_EVENT,
    ON,
    OWNER,
    ROYALE,
    SELF,
    SHRINK,
    START,
    STARVED,
    TURN,
    VERDICT,
    VERDICT_BY,
    WALL,
    WIDTH,
    WRAPPED,
    X,
    Y,
)
from racecraft.worlds.battlesnake.env.kernels.food_and_hazards import after_turn, lay_safe_zone


@inner_kernel
def play_turn(g, moves, bodies, snakes, games, cells, sides, events, chance, params, food_squares):
    """Play one turn of game g: rules, then map, then the count. `moves` (N, M): 0 up, 1 down, 2 left, 3 right."""
    apply_rules(g, moves, bodies, snakes, games, cells, sides, params)
    after_turn(g, bodies, snakes, games, cells, sides, events, chance, params, food_squares)
    games[g, TURN] += 1


@inner_kernel
def apply_rules(g, moves, bodies, snakes, games, cells, sides, params):
    """Walk the ruleset's stages for game g."""
    move(g, moves, bodies, snakes, cells, params)
    lose_health(g, bodies, snakes, games, cells, params)
    feed(g, bodies, snakes, games, cells, params)
    eliminate(g, bodies, snakes, games, cells, params)
    if params[ROYALE]:
        shrink_safe_zone(g, games, cells, sides, params)
    if params[CONSTRICTOR]:
        grow(g, bodies, snakes, games, cells)
    alive = 0
    for s in range(snakes.shape[1]):
        alive += snakes[g, s, CAUSE] == 0
    games[g, ALIVE] = alive


@inner_kernel
def move(g, moves, bodies, snakes, cells, params):
    """New head in front, last segment away; the tail's cell falls free unless another segment lies on it."""
    width, height, wrapped = params[WIDTH], params[HEIGHT], params[WRAPPED]
    last = bodies.shape[2] - 1
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE]:
            continue
        start, length = snakes[g, s, START], snakes[g, s, LENGTH]
        tail = bodies[g, s, (start + length - 1) & last]
        if tail != bodies[g, s, (start + length - 2) & last]:
            cells[g, OWNER, tail] = 0
        x, y, way = snakes[g, s, X], snakes[g, s, Y], moves[g, s]
        x += (way == 3) - (way == 2)
        y += (way == 0) - (way == 1)
        if wrapped:
            x = x - width if x >= width else x + width if x < 0 else x
            y = y - height if y >= height else y + height if y < 0 else y
        start = (start - 1) & last
        bodies[g, s, start] = y * width + x if 0 <= x < width and 0 <= y < height else -1
        snakes[g, s, START], snakes[g, s, X], snakes[g, s, Y] = start, x, y


@inner_kernel
def lose_health(g, bodies, snakes, games, cells, params):
    """One health from each, then the hazards under the head, unless food lies there; at 0 a hazard kills at once."""
    last = bodies.shape[2] - 1
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE]:
            continue
        health = snakes[g, s, HEALTH] - 1
        cell = bodies[g, s, snakes[g, s, START] & last]
        burnt = False
        if cell >= 0 and cells[g, HAZARD, cell] > 0 and cells[g, MEAL, cell] == 0:
            for _ in range(cells[g, HAZARD, cell]):
                health = max(0, min(100, health - params[DAMAGE]))
                burnt = health <= 0
                if burnt:
                    break
        snakes[g, s, HEALTH] = health
        if burnt:
            _leave(g, s, BURNT, -1, bodies, snakes, games, cells)


@inner_kernel
def feed(g, bodies, snakes, games, cells, params):
    """Every living head on food eats it: health 100, tail doubled; then the food is gone."""
    last = bodies.shape[2] - 1
    fed = False
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE]:
            continue
        start, length = snakes[g, s, START], snakes[g, s, LENGTH]
        cell = bodies[g, s, start]
        if cell >= 0 and cells[g, MEAL, cell]:
            snakes[g, s, HEALTH] = 100
            bodies[g, s, (start + length) & last] = bodies[g, s, (start + length - 1) & last]
            snakes[g, s, LENGTH] = length + 1
            fed = True
    if fed:
        for s in range(snakes.shape[1]):
            cell = bodies[g, s, snakes[g, s, START]]
            if snakes[g, s, CAUSE] == 0 and cell >= 0 and cells[g, MEAL, cell]:
                cells[g, MEAL, cell] = 0
                games[g, FOOD] -= 1


@inner_kernel
def eliminate(g, bodies, snakes, games, cells, params):
    """The starved and those off the board first; then verdicts on all collisions, carried out together."""
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE]:
            continue
        if snakes[g, s, HEALTH] <= 0:
            _leave(g, s, STARVED, -1, bodies, snakes, games, cells)
        elif bodies[g, s, snakes[g, s, START]] < 0:
            _leave(g, s, WALL, -1, bodies, snakes, games, cells)
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE] == 0:
            _judge(g, s, bodies, snakes, cells)
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE] == 0 and snakes[g, s, VERDICT]:
            _leave(g, s, snakes[g, s, VERDICT], snakes[g, s, VERDICT_BY], bodies, snakes, games, cells)
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE] == 0:
            cells[g, OWNER, bodies[g, s, snakes[g, s, START]]] = s + 1


@lean_kernel
def shrink_safe_zone(g, games, cells, sides, params):
    """Royale lays its hazards anew each turn; it shows at turn 0, at a shrink, and after a change by the map."""
    turn = games[g, TURN]
    if turn == 0 or (turn + 1) % params[SHRINK] == 0 or params[HAZARD_RULE] != 0 or games[g, NEXT_EVENT] > 0:
        lay_safe_zone(g, (turn + 1) // params[SHRINK], cells, sides, params)


@lean_kernel
def grow(g, bodies, snakes, games, cells):
    """Constrictor: no food; full health and a doubled tail for everyone, the dead too."""
    last = bodies.shape[2] - 1
    if games[g, FOOD]:
        cells[g, MEAL, :] = 0
        games[g, FOOD] = 0
    for s in range(snakes.shape[1]):
        snakes[g, s, HEALTH] = 100
        start, length = snakes[g, s, START], snakes[g, s, LENGTH]
        tail = bodies[g, s, (start + length - 1) & last]
        if tail != bodies[g, s, (start + length - 2) & last]:
            bodies[g, s, (start + length) & last] = tail
            snakes[g, s, LENGTH] = length + 1


@inner_kernel
def _judge(g, s, bodies, snakes, cells):
    """Write the verdict on snake s: 0, or why it dies; the longest that qualifies did it, the first among equals."""
    cell = bodies[g, s, snakes[g, s, START]]
    verdict, by = 0, -1
    owner = cells[g, OWNER, cell]
    if owner == s + 1:
        verdict, by = SELF, s
    elif owner:
        verdict, by = BODY, owner - 1
    else:
        longest = snakes[g, s, LENGTH] - 1
        for other in range(snakes.shape[1]):
            if other == s or snakes[g, other, CAUSE] or bodies[g, other, snakes[g, other, START]] != cell:
                continue
            if snakes[g, other, LENGTH] > longest:
                verdict, by, longest = HEAD, other, snakes[g, other, LENGTH]
    snakes[g, s, VERDICT], snakes[g, s, VERDICT_BY] = verdict, by


@lean_kernel
def _leave(g, s, cause, by, bodies, snakes, games, cells):
    """Take snake s out of the game; its body, all but the new head, falls off the cells."""
    snakes[g, s, CAUSE], snakes[g, s, BY], snakes[g, s, ON] = cause, by, games[g, TURN] + 1
    start, last = snakes[g, s, START], bodies.shape[2] - 1
    for place in range(1, snakes[g, s, LENGTH]):
        cells[g, OWNER, bodies[g, s, (start + place) & last]] = np.int16(0)
