"""By twin: the maps against the recorded output of the official ones."""

import functools
import gzip
import json
from collections import Counter, defaultdict

import pytest
from tests.reference import DATA

from racecraft.worlds.battlesnake.env.board import Board, BoardError, Snake
from racecraft.worlds.battlesnake.env.dice import LoadedDice, StreamDice
from racecraft.worlds.battlesnake.env.hazard_plans import POOLS, expand_box, expand_scatter, royale_sides, spiral
from racecraft.worlds.battlesnake.env.maps import MAPS, MapState, after_turn, move_hazards, set_up
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.solo_maze import build_level, level_of
from racecraft.worlds.battlesnake.env.stages import outside_safe_zone

RECORD = DATA / "battlesnake" / "maps.jsonl.gz"


@functools.cache
def recorded():
    by_kind = defaultdict(list)
    with gzip.open(RECORD, "rt") as file:
        for line in map(json.loads, file):
            by_kind[line["t"]].append(line)
    return by_kind


def counted(points):
    return Counter({(p[0], p[1]): p[2] if len(p) > 2 else 1 for p in points})


def runs(*modes, maps=MAPS):
    plans = {line["id"]: line["data"] for line in recorded()["plan"]}
    for run in recorded()["run"]:
        if run["mode"] in modes and run["map"] in maps:
            yield run, plans.get(run.get("plan"), [])


def settings_of(run):
    return GameSettings(run["w"], run["h"], 1, map=run["map"], shrink_every=run.get("shrink", 25))


def test_every_map_is_there_with_its_sizes_and_players():
    declared = {line["id"]: line for line in recorded()["map"]}
    assert set(declared) == set(MAPS)
    for name, row in MAPS.items():
        assert sorted(row.sizes) == sorted(map(tuple, declared[name]["sizes"])), name
        assert row.most_players == declared[name]["max_players"], name


def test_standing_hazards_are_the_recorded_ones():
    checked = 0
    for line in recorded()["hazset"]:
        if line["map"] in ("solo_maze", "healing_pools"):
            continue
        board, _ = set_up(GameSettings(line["w"], line["h"], 1, map=line["map"]), StreamDice(3))
        assert board.hazards == counted(line["data"]), (line["map"], line["w"])
        checked += 1
    assert checked == 27


def test_healing_pools_are_the_recorded_ones_and_some_that_lie_opposite_each_other():
    for line in recorded()["hazset"]:
        if line["map"] == "healing_pools":
            assert tuple(map(tuple, line["data"])) in POOLS[line["w"]]
    assert {side: len(choices) for side, choices in POOLS.items()} == {7: 1, 11: 4, 19: 2}


def loaded_plan(run, changes):
    """Our plan, with dice that fall as the record's first square shows; None where the plan is not fixed by it."""
    settings, first = settings_of(run), changes[0].get("add", [[0, 0]])[0] if changes else [0, 0]
    if run["map"] == "hz_spiral":
        return spiral(settings, LoadedDice([first[0] - 3 * run["w"] // 10, first[1] - 3 * run["h"] // 10]))
    if run["map"] == "hz_expand_box":
        return expand_box(settings, LoadedDice([first[0] - 2, first[1] - 2]))
    return MAPS[run["map"]].plan(settings, LoadedDice())


@pytest.mark.parametrize("name", ["hz_spiral", "hz_expand_box", "sinkholes", "hz_hazard_pits"])
def test_hazards_come_on_the_recorded_turns_at_the_recorded_squares(name):
    checked = set()
    for run, changes in runs("keep", "long", maps=[name]):
        if run["plan"] in checked:
            continue
        checked.add(run["plan"])
        ours = defaultdict(Counter)
        for turn, point, added in loaded_plan(run, changes).changes:
            if turn < run["turns"]:
                ours[turn][point] += added
        theirs = {c["turn"]: counted(c.get("add", [])) for c in changes}
        for change in changes:
            theirs[change["turn"]].subtract(counted(change.get("del", [])))
        assert dict(ours) == theirs, (run["w"], run["h"])
    assert checked


def test_shuffled_plans_keep_the_recorded_clock_and_order():
    for run, changes in runs("keep", maps=["hz_scatter", "hz_expand_scatter", "hz_grow_box"]):
        start, step = {"hz_scatter": (1, 2), "hz_expand_scatter": (0, 2), "hz_grow_box": (0, 12)}[run["map"]]
        turns = [change["turn"] for change in changes]
        assert turns == [start + step * number for number in range(len(turns))]
        ours = [turn for turn, _, _ in MAPS[run["map"]].plan(settings_of(run), StreamDice(1)).changes]
        assert sorted(set(turn for turn in ours if turn < run["turns"]))[: len(turns)] == turns
    plan = expand_scatter(GameSettings(7, 7, map="hz_expand_scatter"), StreamDice(2))
    (x, y), order = plan.changes[0][1], [point for _, point, _ in plan.changes]
    radii = [max(abs(a - x), abs(b - y)) for a, b in order]
    assert radii == sorted(radii)
    assert sorted(order) == sorted((a, b) for a in range(7) for b in range(7))


def test_royale_is_explained_by_one_list_of_sides():
    for run, changes in runs("keep", maps=["royale"]):
        board, sides, seen = Board(run["w"], run["h"]), [], Counter()
        for change in changes:
            seen += counted(change["add"])
            while board.turn + 1 < change["turn"] + 1:
                board.turn += 1
            shrinks = (change["turn"] + 1) // run.get("shrink", 25)
            while len(sides) < shrinks:
                fits = [side for side in range(4) if outside_safe_zone(board, [*sides, side]) == seen]
                sides.append(fits[0] if fits else 0)
            assert outside_safe_zone(board, sides) == seen


def test_snails_leave_the_recorded_trails():
    frames = 0
    for run, _ in runs("crawl"):
        board = Board(run["w"], run["h"], 0, [Snake(str(i), [tuple(p)] * 3) for i, p in enumerate(run["heads"])])
        settings = GameSettings(run["w"], run["h"], 4, map="snail_mode")
        for frame in run["frames"]:
            for snake in board.snakes:
                x, y = snake.head
                snake.body = [(x, (y + 1) % run["h"]), *snake.body[:-1]]
                if frame["turn"] % 15 == 14:
                    snake.body.append(snake.body[-1])
            move_hazards(board, settings, MapState(MAPS["empty"].plan(settings, LoadedDice()), []))
            assert +board.hazards == counted(frame["hz"])
            frames += 1
    assert frames > 300


def test_starts_and_first_food_stand_where_they_were_recorded():
    """With enough set-ups ours show every square the records show, and never another number of foods."""
    seen = defaultdict(lambda: (set(), set(), set()))
    for run, _ in runs("keep", "setup"):
        if "heads" in run and run["w"] in (7, 11, 19) and run["players"] in (1, 4, 8) and run["map"] != "solo_maze":
            heads, food, counts = seen[run["map"], run["w"], run["h"], run["players"]]
            heads.update(map(tuple, run["heads"]))
            food.update(map(tuple, run["food"]))
            counts.add(len(run["food"]))
    chosen = {k: v for k, v in seen.items() if k[0] == "standard" or MAPS[k[0]].drawn}
    for (name, width, height, players), (heads, food, counts) in chosen.items():
        dice, our_heads, our_food, our_counts = StreamDice(9), set(), set(), set()
        for _ in range(250):
            board, _ = set_up(GameSettings(width, height, players, map=name), dice)
            our_heads.update(snake.head for snake in board.snakes)
            our_food.update(board.food)
            our_counts.add(len(board.food))
        place = (name, width, players)
        assert heads <= our_heads, place
        assert food <= our_food, place
        assert counts == our_counts, place
    assert len(chosen) > 15


def test_food_falls_as_often_and_where_it_was_recorded():
    """Each recorded share of updates with food is within five standard deviations of ours."""
    places = defaultdict(set)
    for line in recorded()["foodstats"]:
        places[line["map"]].update((p[0], p[1]) for p in line.get("hist", []))
    for line in recorded()["foodstats"]:
        if line["map"] not in ("standard", "arcade_maze", "hz_castle_wall") or line.get("snakes_absent"):
            continue
        settings = GameSettings(
            line["w"], line["h"], line["players"], map=line["map"],
            food_spawn_chance=line["chance"], minimum_food=line["min"],
        )  # fmt: skip
        dice = StreamDice(line["chance"] + 1)
        board, state = set_up(settings, dice)
        fed, updates = 0, 600
        for _ in range(updates):
            board.food, board.turn = [], 20
            after_turn(board, settings, state, dice)
            fed += bool(board.food)
            assert line["map"] == "standard" or set(board.food) <= places[line["map"]]
        theirs, ours = line["with_food"] / line["updates"], fed / updates
        spread = (max(theirs * (1 - theirs), 1e-4) * (1 / updates + 1 / line["updates"])) ** 0.5
        assert abs(ours - theirs) < 5 * spread, (line["map"], line["chance"], line["min"])


def test_solo_maze_grows_with_every_food_as_recorded():
    first = {}
    for run, _ in runs("levels"):
        first.setdefault((run["w"], run["h"]), run)
    for (width, height), run in first.items():
        settings, dice = GameSettings(width, height, 1, "solo", "solo_maze"), StreamDice(4)
        board, state = set_up(settings, dice)
        for number, level in enumerate(run["levels"][:14]):
            assert level_of(board) == number
            assert board.snakes[0].body == [tuple(p) for p in level["body"]]
            notes = "".join("1" if board.hazards[(x, 0)] else "." for x in range(width))
            assert notes == level["rows"][0]
            walls = [p for p in board.squares() if level["rows"][p[1]][p[0]] != "."]
            frame = [p for p in walls if not inside(p, board, number)]
            assert all(board.hazards[p] for p in frame)
            assert board.food[0] != board.snakes[0].head
            assert not board.hazards[board.food[0]]
            board.food = []
            after_turn(board, settings, state, dice)


class WatchedDice(StreamDice):
    """Dice that remember among how many the last roll chose."""

    def below(self, count):
        self.last = count
        return super().below(count)


def test_the_food_of_a_solo_maze_stands_anywhere_the_snake_can_come_to():
    settings, level = GameSettings(19, 21, 1, "solo", "solo_maze"), 12
    for seed in range(20):
        dice = WatchedDice(seed)
        board, _ = set_up(settings, dice)
        build_level(board, level, dice)
        floor = {point for point in board.squares() if inside(point, board, level) and not board.hazards[point]}
        come_to = {board.snakes[0].head}
        while more := {point for point in floor - come_to if any(is_beside(point, one) for one in come_to)}:
            come_to |= more
        assert dice.last == len(come_to) - 1
        assert board.food[0] in come_to


def is_beside(one, other):
    return abs(one[0] - other[0]) + abs(one[1] - other[1]) == 1


def inside(point, board, level):
    side = min(7 + level, board.width, board.height - 2)
    left, bottom = (board.width - side) // 2, (board.height - side) // 2
    return left <= point[0] < left + side and bottom <= point[1] < bottom + side


@pytest.mark.parametrize("side", [7, 11])
def test_healing_pools_lie_opposite_each_other_across_the_middle(side):
    for pools in POOLS[side]:
        assert {(side - 1 - x, side - 1 - y) for x, y in pools} == set(pools)


def test_royale_draws_sides_until_nothing_is_left_of_one_length():
    """Of 7 x 11 squares seven columns go, from the left and from the right, or eleven rows."""
    settings = GameSettings(7, 11, 2)
    assert royale_sides(settings, LoadedDice([0, 1, 2, 3] * 9)) == [0, 1, 2, 3] * 3 + [0]
    assert royale_sides(settings, LoadedDice([1] * 20)) == [1] * 7
    assert royale_sides(settings, LoadedDice([2] * 20)) == [2] * 11


@pytest.mark.parametrize(
    ("name", "words", "letter"),
    [
        ("royale", {"shrink_every": 0}, "royale: hazards every 0 turns; expected at least 1"),
        ("standard", {"shrink_every": 0, "ruleset": "royale"}, "standard: hazards every 0 turns"),
        ("solo_maze", {"players": 2}, "map solo_maze with 2 snakes; expected at most 1"),
        ("solo_maze", {"players": 1, "height": 6}, "map solo_maze on 11x6; expected at least 7x7"),
        ("sinkholes", {"width": 7}, "map sinkholes on 7x11; expected 7x7, 11x11, 19x19"),
    ],
)
def test_what_a_map_cannot_be_played_with_is_refused(name, words, letter):
    with pytest.raises(BoardError, match=letter):
        MAPS[name].check(GameSettings(**words))


def test_a_map_without_a_schedule_of_its_own_needs_none():
    for name in ("standard", "healing_pools", "sinkholes", "hz_spiral"):
        set_up(GameSettings(map=name, shrink_every=0), LoadedDice())


@pytest.mark.parametrize(
    ("name", "ruleset", "closes_in"),
    [("royale", "standard", True), ("hz_rings", "royale", True), ("hz_rings", "standard", False)],
)
def test_sides_are_drawn_where_the_map_or_the_ruleset_is_royale(name, ruleset, closes_in):
    _, state = set_up(GameSettings(7, 7, 2, ruleset, name), StreamDice(1))
    assert bool(state.sides) == closes_in


def test_dice_are_rolled_for_starts_then_food_then_hazards():
    """Seven for the order of the starts, one for each snake's food, two for where the spiral begins."""
    dice = StreamDice(3)
    _, state = set_up(GameSettings(11, 11, 4, map="hz_spiral"), dice)
    assert dice.counter == 7 + 4 + 2
    again = StreamDice(3, counter=11)
    assert spiral(GameSettings(11, 11, 4), again).changes == state.plan.changes


def fallen(name, *rolls, turn=20, food=(), bodies=((0, 0),), **words):
    """What falls after a turn with dice as told."""
    side = MAPS[name].sizes[0]
    board = Board(*side, turn, [Snake(str(n), [body] * 3) for n, body in enumerate(bodies)], list(food))
    settings = GameSettings(*side, 1, map=name, **words)
    after_turn(board, settings, MapState(MAPS["empty"].plan(settings, LoadedDice()), []), LoadedDice(rolls))
    return board.food[len(food) :]


def test_in_the_arcade_food_falls_with_one_percent_more_than_the_chance_on_free_squares_of_a_list():
    assert fallen("arcade_maze", 15, food_spawn_chance=15) == [(1, 1)]
    assert fallen("arcade_maze", 16, food_spawn_chance=15) == []
    assert fallen("arcade_maze", 0, food_spawn_chance=0) == []
    taken = {"food": [(3, 11)], "bodies": [(1, 1), (4, 7)]}
    assert fallen("arcade_maze", 0, food_spawn_chance=15, **taken) == [(4, 17)]
    assert [fallen("arcade_maze", 0, roll, food_spawn_chance=15) for roll in (1, 99)] == [[(3, 11)], [(17, 1)]]


def test_in_a_castle_food_falls_from_turn_10_on_up_to_the_most_not_near_heads_or_other_food():
    """Its squares are (2, 5), (5, 2), (5, 8) and (8, 5); at most two lie at a time."""
    assert fallen("hz_castle_wall", turn=9) == []
    assert fallen("hz_castle_wall", turn=10, food_spawn_chance=0) == [(2, 5)]
    assert fallen("hz_castle_wall", food=[(0, 10)]) == [(2, 5)]
    assert fallen("hz_castle_wall", food=[(0, 10), (10, 10)]) == []
    assert fallen("hz_castle_wall", food=[(2, 6)]) == [(5, 2)], "the passage of another food"
    assert fallen("hz_castle_wall", bodies=[(2, 5), (5, 1)]) == [(5, 8)], "under a snake, beside a head"
    assert {name: row.castle_food for name, row in MAPS.items() if row.castle_food} == {
        "hz_castle_wall": 2, "hz_castle_wall_lg": 2, "hz_castle_wall_xl": 4,
    }  # fmt: skip


def test_where_food_spares_hazards_it_falls_on_none():
    settings = GameSettings(11, 11, 1, map="hz_rivers_bridges", food_spawn_chance=0, minimum_food=121)
    board, state = set_up(settings, StreamDice(2))
    after_turn(board, settings, state, LoadedDice())
    assert not [point for point in board.food if board.hazards[point]]
    assert len(board.food) > 50
    plain = Board(11, 11, 3, board.snakes, [], board.hazards.copy())
    after_turn(plain, GameSettings(11, 11, 1, food_spawn_chance=0, minimum_food=121), state, LoadedDice())
    assert [point for point in plain.food if board.hazards[point]]
