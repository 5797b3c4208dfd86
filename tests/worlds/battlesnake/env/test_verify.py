"""What a check of recorded games finds, told by games of our own that were spoilt in one place."""

from collections import Counter

import pytest

from racecraft.worlds.battlesnake.env.board import MOVES, neighbours
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.records import RecordedGame, RecordedStep
from racecraft.worlds.battlesnake.env.reference import Referee, apply_rules
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.verify import board_text, verify_games


def a_way(board, snake):
    """The first move onto a free square of the board."""
    taken = {point for other in board.alive() for point in other.body}
    free = [point in taken or not board.holds(point) for point in neighbours(snake.head)]
    return MOVES[free.index(False)] if False in free else "up"


def played(turns=6, width=11, height=11, players=2, straight=False, **words):
    """A game as the referee plays it."""
    settings = GameSettings(width, height, players, **words)
    referee = Referee(settings, StreamDice(4))
    game = RecordedGame(17, settings, referee.board.copy())
    for _ in range(turns):
        if referee.over:
            break
        before = referee.board.copy()
        moves = {snake.id: "onward" if straight else a_way(before, snake) for snake in before.alive()}
        after_rules = before.copy()
        apply_rules(referee.rules, after_rules, moves, referee.table)
        game.steps.append(RecordedStep(moves, before, after_rules, referee.turn(moves).copy()))
    return game


def found(game):
    """What is told of a game: how many differences, and the first line of each example."""
    report = verify_games([game])
    return report.mismatches, [example.splitlines()[0].partition("turn ")[2] for example in report.examples]


@pytest.mark.parametrize(
    "words",
    [
        {},
        {"ruleset": "royale", "shrink_every": 2},
        {"ruleset": "wrapped", "map": "hz_spiral", "food_spawn_chance": 100},
        {"ruleset": "constrictor"},
        {"map": "hz_rivers_bridges", "food_spawn_chance": 100},
        {"map": "arcade_maze", "width": 19, "height": 21, "food_spawn_chance": 100},
        {"map": "sinkholes", "shrink_every": 2},
        {"map": "snail_mode"},
        {"map": "solo_maze", "ruleset": "solo", "players": 1},
    ],
    ids=lambda words: " ".join(map(str, words.values())) or "standard",
)
def test_games_that_our_referee_played_agree(words):
    game = played(**words)
    report = verify_games([game, game])
    assert report.mismatches == 0, "\n".join(report.examples)
    assert (report.games, report.steps, report.agrees) == (2, 2 * len(game.steps), True)
    assert len(game.steps) > 2
    assert report.to_dict() == {
        "games": 2, "steps": 2 * len(game.steps), "mismatches": 0, "examples": [], "unread": [],
    }  # fmt: skip


def test_a_difference_is_told_with_its_place_and_both_boards():
    game = played(2)
    after = game.steps[1].after_rules
    ours = board_text(after)
    after.snakes[0].health -= 1
    report = verify_games([game])
    assert report.mismatches == 2
    assert not report.agrees
    assert report.examples == [
        f"game at line 17 (standard on standard), turn 1: {who}\nrecorded:\n{board_text(after)}\nours:\n{ours}"
        for who in ("referee", "kernel")
    ]


def test_three_differences_are_drawn_and_all_are_counted():
    game = played(4)
    for step in game.steps:
        step.after_rules.food.append((7, 7))
    mismatches, told = found(game)
    assert mismatches == 8
    assert told == ["0: referee", "0: kernel", "1: referee"]


def test_food_that_cannot_have_fallen_is_told():
    head = played(1).steps[0].after_rules.snakes[0].head
    for words, square in (
        ({}, head),
        ({"map": "empty"}, (5, 5)),
        ({"map": "hz_castle_wall"}, (0, 5)),
        ({"map": "hz_rivers_bridges"}, None),
        ({"map": "arcade_maze", "width": 19, "height": 21}, (2, 1)),
    ):
        game = played(1, **words)
        step = game.steps[0]
        square = square or next(point for point in step.after_rules.free_squares() if step.after_rules.hazards[point])
        step.after_map.food.append(square)
        assert found(game) == (1, [f"0: food fell on [{square}]"]), words


def test_food_may_fall_where_the_map_lets_it():
    for words, square in (
        ({}, None),
        ({"map": "hz_columns"}, None),
        ({"map": "hz_castle_wall"}, (5, 2)),
        ({"map": "arcade_maze", "width": 19, "height": 21}, (9, 1)),
    ):
        game = played(1, **words)
        step = game.steps[0]
        free = [point for point in step.after_rules.free_squares() if words == {} or step.after_rules.hazards[point]]
        step.after_map.food.append(square or free[-1])
        assert found(game) == (0, []), words


@pytest.mark.parametrize(
    ("words", "is_told"),
    [
        ({}, True),
        ({"map": "hz_rings"}, True),
        ({"map": "hz_spiral"}, False),
        ({"map": "solo_maze", "ruleset": "solo", "players": 1}, False),
    ],
)
def test_hazards_are_held_to_the_map_where_no_dice_are_in_it(words, is_told):
    game = played(1, **words)
    game.steps[0].after_map.hazards[(8, 3)] += 5
    assert found(game) == ((1, ["0: the map's hazards"]) if is_told else (0, []))


def test_royale_hazards_that_no_list_of_sides_explains_are_told():
    """A side has closed in by turn 1; a hazard in the middle of the board is none."""
    game = played(2, ruleset="royale", shrink_every=2)
    game.steps[1].after_rules.hazards = Counter({(5, 5): 1})
    game.steps[1].after_map.hazards = Counter({(5, 5): 1})
    assert found(game) == (2, ["1: referee", "1: kernel"])


def test_a_game_is_over_where_its_record_says_and_not_before():
    game = played(30, straight=True)
    last = game.steps[-1].after_map
    assert len(last.alive()) < 2
    game.over_turn = last.turn
    assert found(game) == (0, [])
    game.over_turn += 1
    assert found(game) == (1, [f"{last.turn}: the record is over at turn {last.turn + 1}"])
    game = played(2)
    game.over_turn = 2
    assert found(game) == (1, ["2: the record is over at turn 2"]), "two are alive"
    game.steps.clear()
    game.over_turn = 0
    assert found(game) == (1, ["0: the record is over at turn 0"])


def test_a_turn_after_the_end_is_told():
    settings = GameSettings(7, 7, 1)
    game = played(3, 7, 7, 1, ruleset="solo")
    game.settings = settings
    mismatches, told = found(game)
    assert (mismatches, told[0]) == (3, "0: the game was over before this turn")


def test_turns_after_one_that_is_missing_were_not_read():
    game = played(2)
    game.missing_turn = 2
    report = verify_games([game])
    assert report.agrees
    assert report.unread == ["game at line 17: turn 2 is missing; the turns after it were not verified"]
