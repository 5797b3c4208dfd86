"""Moves read off bodies, by hand: positions of two snakes on 7 x 7 squares and what is to be told between them."""

from collections import Counter
from dataclasses import replace

import pytest

from racecraft.worlds.battlesnake.env.board import MOVES, Board, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.transcript import Frame, recorded_game

SETTINGS = GameSettings(7, 7, 2)
A = {3: [(3, 3), (3, 2), (3, 1)], 4: [(4, 3), (3, 3), (3, 2)], 5: [(4, 2), (4, 3), (3, 3)]}
B = {3: [(5, 5), (5, 4), (5, 3)], 4: [(5, 6), (5, 5), (5, 4)], 5: [(4, 6), (5, 6), (5, 5)]}


def frame(turn, a=None, b=None, food=(), hazards=(), **dead):
    snakes = [Snake(name, body, 100 - turn) for name, body in (("a", a), ("b", b)) if body]
    return Frame(Board(7, 7, turn, snakes, list(food), Counter(hazards)), dead)


def both(*turns, **words):
    return [frame(turn, A[turn], B[turn], **words) for turn in turns]


def test_a_living_snake_shows_its_move_by_its_next_head():
    frames = both(3, 4, 5)
    game = recorded_game(SETTINGS, frames, over=False)
    assert [step.moves for step in game.steps] == [{"a": "right", "b": "up"}, {"a": "down", "b": "left"}]
    assert (game.line, game.settings, game.start) == (1, SETTINGS, frames[0].board)
    first = game.steps[0]
    assert (first.before, first.after_map) == (frames[0].board, frames[1].board)
    assert (first.after_rules.turn, first.after_rules.snakes) == (3, frames[1].board.snakes)
    assert (game.over_turn, game.missing_turn) == (None, None)
    over = recorded_game(SETTINGS, frames, over=True, line=9)
    assert (over.over_turn, over.line) == (5, 9)


@pytest.mark.parametrize(
    ("turns", "steps", "missing", "over"),
    [((3, 3, 4, 4, 5), 2, None, 5), ((3, 5), 0, 4, None), ((4, 5, 3), 1, 6, None), ((3,), 0, None, 3)],
)
def test_a_position_told_twice_counts_once_and_a_gap_ends_what_can_be_replayed(turns, steps, missing, over):
    game = recorded_game(SETTINGS, both(*turns), over=True)
    assert (len(game.steps), game.missing_turn, game.over_turn) == (steps, missing, over)


def test_over_the_border_of_a_wrapped_board_a_step_is_a_step():
    frames = [frame(3, [(6, 3), (5, 3)], [(2, 0), (2, 1)]), frame(4, [(0, 3), (6, 3)], [(2, 6), (2, 0)])]
    (step,) = recorded_game(replace(SETTINGS, ruleset="wrapped"), frames, over=False).steps
    assert step.moves == {"a": "right", "b": "down"}


@pytest.mark.parametrize(("food", "moves"), [((), {"a": "right", "b": "left"}), (((4, 3),), None)])
def test_who_left_together_over_food_met_there_where_the_food_is_gone(food, moves):
    before = frame(3, [(3, 3), (3, 2), (3, 1)], [(5, 3), (5, 4), (5, 5)], food=[(4, 3)])
    (step,) = recorded_game(SETTINGS, [before, frame(4, food=food)], over=True).steps
    assert (step.moves == {"a": "right", "b": "left"}) == (moves is not None)
    assert step.after_rules.food == list(food)
    assert {snake.cause for snake in step.after_rules.snakes} == (
        {"head-collision"} if moves else {"snake-self-collision"}
    )


def test_who_left_without_a_word_made_the_move_by_which_the_rules_end_it():
    frames = [frame(3, A[3], [(6, 5)]), frame(4, A[4])]
    (step,) = recorded_game(SETTINGS, frames, over=False).steps
    assert step.moves == {"a": "right", "b": "right"}
    gone = step.after_rules.snakes[1]
    assert (gone.cause, gone.on, step.after_map.snakes[1]) == ("wall-collision", 4, gone)


def test_who_left_although_no_move_ends_it_is_told_as_it_was_and_by_its_first_move():
    """A snake of one square in the open: nothing can end it."""
    frames = [frame(3, A[3], [(3, 5)]), frame(4, A[4])]
    (step,) = recorded_game(SETTINGS, frames, over=False).steps
    gone = step.after_rules.snakes[1]
    assert (step.moves["b"], gone.cause, gone.on) == (MOVES[0], "snake-collision", 4)


def test_what_is_told_of_the_dead_stands_before_what_the_rules_say():
    told = Snake("b", [(6, 5), (5, 5), (4, 5)], 0, "hazard", "", 4)
    frames = [frame(3, A[3], [(5, 5), (4, 5), (3, 5)]), frame(4, A[4], b=None)]
    frames[1].dead["b"] = told
    (step,) = recorded_game(SETTINGS, frames, over=False).steps
    assert step.moves["b"] == "right", "read off where it lies"
    assert step.after_rules.snakes[1] == told
    frames = [frame(3, A[3], [(6, 5)]), frame(4, A[4])]
    frames[1].dead["b"] = Snake("b", [], 0, "hazard", "", 7)
    (step,) = recorded_game(SETTINGS, frames, over=False).steps
    gone = step.after_rules.snakes[1]
    assert (gone.cause, gone.on) == ("hazard", 7)
    frames[1].dead["b"] = Snake("b", [], 0, "", "", 0)
    (step,) = recorded_game(SETTINGS, frames, over=False).steps
    gone = step.after_rules.snakes[1]
    assert (step.moves["b"], gone.cause, gone.on) == ("right", "wall-collision", 4), "what is not told is the rules'"


def test_food_and_hazards_after_the_rules_are_those_that_stood_there_before():
    marks = [(0, 0), (0, 0), (1, 1)]
    frames = [frame(3, A[3], B[3], [(0, 0), (6, 0)], marks), frame(4, A[4], B[4], [(0, 0), (2, 2)], [(6, 6)])]
    (step,) = recorded_game(SETTINGS, frames, over=False).steps
    assert (step.after_rules.food, step.after_rules.hazards) == ([(0, 0)], Counter(marks))
    assert (step.after_map.food, step.after_map.hazards) == ([(0, 0), (2, 2)], Counter([(6, 6)]))
    (step,) = recorded_game(replace(SETTINGS, ruleset="royale"), frames, over=False).steps
    assert step.after_rules.hazards == Counter(), "royale's rule lays what has closed in, no square yet"
    whole_side = Counter((6, y) for y in range(7))
    frames[1].board.hazards = whole_side + Counter([(2, 2)])
    (step,) = recorded_game(replace(SETTINGS, ruleset="royale", shrink_every=4), frames, over=False).steps
    assert step.after_rules.hazards == whole_side


def test_the_last_position_told_once_more_is_no_turn_where_the_game_is_decided():
    alone = [frame(3, A[3], [(6, 5), (5, 5), (4, 5)]), frame(4, A[4]), frame(5, A[4])]
    game = recorded_game(SETTINGS, alone, over=True)
    assert (len(game.steps), game.over_turn) == (1, 4)
    moved = [*alone[:2], frame(5, A[5])]
    assert len(recorded_game(SETTINGS, moved, over=True).steps) == 2, "it went on after its end"
    still = [*both(3), frame(4, A[3], B[3])]
    assert len(recorded_game(SETTINGS, still, over=True).steps) == 1, "nobody stands still in a game that goes on"
