"""Players 1 to 3 compiled, for many boards at once: opponents and yardsticks at the speed of training.

Each is held equal, move for move, to its readable page (`random_safe.py`, `hungry.py`, `flood_fill.py`) by test; only
random_safe rolls other dice. Begin at `anchor_moves`.
"""

from __future__ import annotations

from racecraft.kernels import lean_kernel
from racecraft.worlds.battlesnake.env.kernels.columns import CAUSE, HAZARD, HEALTH, HEIGHT, LENGTH, MEAL, WIDTH, WRAPPED
from racecraft.worlds.battlesnake.env.kernels.food_and_hazards import below
from racecraft.worlds.battlesnake.env.kernels.outlook import head_of, neighbour, openings, pour
from racecraft.worlds.battlesnake.players.kernels.territory import safe_ways

NOT_HERE, RANDOM_SAFE, HUNGRY, FLOOD_FILL = 0, 1, 2, 3
"""Who sits at a seat."""
HUNGRY_BELOW = 40
"""As in `flood_fill.py`."""


@lean_kernel
def anchor_moves(first, beyond, who, bodies, snakes, games, cells, params, chance, scratch, moves):
    """Choose for the seats that anchors hold.

    Args:
        first: First game.
        beyond: The game after the last.
        who: int8 (N, M): NOT_HERE, or which anchor.
        bodies: The arrays of `state.Games`, as are `snakes`, `games`, `cells`.
        snakes: See above.
        games: See above.
        cells: See above.
        params: Settings, see `columns.py`.
        chance: uint64 (N, 2): key and counter of the dice of random_safe, not the game's own.
        scratch: int32 (N, 5, C): room to work in.
        moves: int64 (N, M): written where an anchor sits and lives.
    """
    for g in range(first, beyond):
        for s in range(who.shape[1]):
            if who[g, s] == NOT_HERE or snakes[g, s, CAUSE]:
                continue
            safe = scratch[g, 4, :4]
            count = safe_ways(g, s, bodies, snakes, cells, params, safe)
            if count == 0:
                moves[g, s] = 0
            elif who[g, s] == RANDOM_SAFE:
                moves[g, s] = _any(g, count, safe, chance)
            elif who[g, s] == HUNGRY:
                moves[g, s] = _to_food(g, s, bodies, snakes, cells, params, safe)
            else:
                moves[g, s] = _to_open_space(g, s, bodies, snakes, cells, params, safe, scratch[g])


@lean_kernel
def _any(g, count, safe, chance):
    """Return one of the safe ways, each as likely."""
    left, way = below(g, chance, count), -1
    while left >= 0:
        way += 1
        left -= safe[way]
    return way


@lean_kernel
def _to_food(g, s, bodies, snakes, cells, params, safe):
    """Return the safe way that ends nearest to a food; the first of equals."""
    best, fewest = 0, -1
    for way in range(4):
        if safe[way]:
            steps = _steps_to_food(g, neighbour(head_of(g, s, bodies, snakes), way, params), cells, params)
            if fewest < 0 or steps < fewest:
                best, fewest = way, steps
    return best


@lean_kernel
def _steps_to_food(g, cell, cells, params):
    """Return how many moves the nearest food is away when nothing is in between; 0 where there is no food."""
    width, height, fewest = params[WIDTH], params[HEIGHT], -1
    for food in range(cells.shape[2]):
        if cells[g, MEAL, food]:
            dx, dy = abs(food % width - cell % width), abs(food // width - cell // width)
            if params[WRAPPED]:
                dx, dy = min(dx, width - dx), min(dy, height - dy)
            if fewest < 0 or dx + dy < fewest:
                fewest = dx + dy
    return max(0, fewest)


@lean_kernel
def _to_open_space(g, s, bodies, snakes, cells, params, safe, scratch):
    """Return the safe way with room for the body; then no stronger head near; then food, if wanted; then most room."""
    length, longest = snakes[g, s, LENGTH], 0
    for other in range(snakes.shape[1]):
        if other != s and snakes[g, other, CAUSE] == 0:
            longest = max(longest, snakes[g, other, LENGTH])
    wants_food = snakes[g, s, HEALTH] < HUNGRY_BELOW or length <= longest + 1
    openings(g, bodies, snakes, cells, scratch[0])
    best = -1
    best_enough, best_threat, best_harm, best_food, best_room = 0.0, 0, 0, 0, 0
    for way in range(4):
        if not safe[way]:
            continue
        cell = neighbour(head_of(g, s, bodies, snakes), way, params)
        room, food, _ = pour(g, cell, cell, cells, params, scratch)
        food_steps = (food - 1 if food else params[WIDTH] * params[HEIGHT]) if wants_food else 0
        enough, harm = min(1.0, room / length), cells[g, HAZARD, cell]
        threat = _stronger_heads_near(g, s, cell, bodies, snakes, params)
        better = enough > best_enough
        if enough == best_enough:
            better = threat < best_threat
            if threat == best_threat:
                better = harm < best_harm
                if harm == best_harm:
                    better = food_steps < best_food or (food_steps == best_food and room > best_room)
        if best < 0 or better:
            best, best_enough, best_threat, best_harm, best_food, best_room = (
                way, enough, threat, harm, food_steps, room
            )  # fmt: skip
    return best


@lean_kernel
def _stronger_heads_near(g, s, cell, bodies, snakes, params):
    """Count the other heads, not shorter than snake s, that could enter a cell in this turn too."""
    count = 0
    for other in range(snakes.shape[1]):
        if other == s or snakes[g, other, CAUSE] or snakes[g, other, LENGTH] < snakes[g, s, LENGTH]:
            continue
        for way in range(4):
            if neighbour(head_of(g, other, bodies, snakes), way, params) == cell:
                count += 1
                break
    return count
