"""By hand: one situation each, small enough to see."""

import pytest

from racecraft.worlds.battlesnake.env.board import MOVES, STEPS, Board, BoardError, Snake
from racecraft.worlds.battlesnake.env.dice import LoadedDice, StreamDice
from racecraft.worlds.battlesnake.env.hazard_plans import Plan
from racecraft.worlds.battlesnake.env.maps import MapState, after_turn, standard_food_rule
from racecraft.worlds.battlesnake.env.reference import Referee, apply_rules
from racecraft.worlds.battlesnake.env.rulesets import find_ruleset, is_over
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import GameContext, default_move


def snake(name, *body, health=50):
    return Snake(name, list(body), health)


def play(board, ruleset="standard", damage=14, **moves):
    settings = GameSettings(board.width, board.height, ruleset=ruleset, hazard_damage=damage)
    apply_rules(find_ruleset(ruleset), board, moves, GameContext(settings, sides=[0, 3]))
    return {each.id: (each.cause, each.by, each.on) for each in board.snakes}


def facing(length_a, length_b):
    """Two snakes with one square between their heads, a on the left."""
    a = snake("a", *[(3 - i, 5) for i in range(length_a)])
    b = snake("b", *[(5 + i, 5) for i in range(length_b)])
    return Board(11, 11, 7, [a, b])


@pytest.mark.parametrize("side", [3, 4, 11])
@pytest.mark.parametrize("move", MOVES)
def test_a_snake_that_gives_no_move_goes_straight_on_across_every_edge(side, move):
    dx, dy = STEPS[MOVES.index(move)]
    for x in range(side):
        for y in range(side):
            assert default_move([((x + dx) % side, (y + dy) % side), (x, y)], side, side) == move
            assert default_move([(x, y), (x, y)], side, side) == "up"


def test_the_longer_head_wins_and_equal_heads_both_die():
    assert play(facing(4, 3), a="right", b="left") == {"a": ("", "", 0), "b": ("head-collision", "a", 8)}
    both = play(facing(3, 3), a="right", b="left")
    assert both == {"a": ("head-collision", "b", 8), "b": ("head-collision", "a", 8)}


def test_food_is_eaten_before_heads_are_compared():
    board = facing(3, 3)
    board.food = [(4, 5)]
    fates = play(board, a="right", b="left")
    assert {fate[0] for fate in fates.values()} == {"head-collision"}
    assert [len(each.body) for each in board.snakes] == [4, 4]
    assert board.food == []


def test_heads_that_swap_squares_both_run_into_bodies_whatever_their_length():
    board = Board(11, 11, 0, [snake("a", (3, 5), (2, 5), (1, 5)), snake("b", (4, 5), (5, 5), (6, 5), (7, 5))])
    fates = play(board, a="right", b="left")
    assert fates == {"a": ("snake-collision", "b", 1), "b": ("snake-collision", "a", 1)}


def test_a_reversal_is_a_collision_with_the_own_neck():
    board = Board(11, 11, 0, [snake("a", (3, 5), (2, 5), (1, 5)), snake("b", (9, 9), (9, 8), (9, 7))])
    assert play(board, a="left", b="up")["a"] == ("snake-self-collision", "a", 1)


def test_a_tail_moves_away_unless_its_snake_just_ate():
    chaser = snake("a", (3, 5), (3, 6), (3, 7))
    free = Board(11, 11, 0, [chaser.copy(), snake("b", (6, 5), (5, 5), (4, 5))])
    assert play(free, a="right", b="right")["a"] == ("", "", 0)
    doubled = Board(11, 11, 0, [chaser.copy(), snake("b", (6, 5), (5, 5), (4, 5), (4, 5))])
    assert play(doubled, a="right", b="right")["a"] == ("snake-collision", "b", 1)


def test_who_leaves_the_board_or_starves_is_no_obstacle():
    a, b = snake("a", (1, 5), (2, 5), (3, 5)), snake("b", (0, 4), (0, 5), (0, 6))
    fates = play(Board(11, 11, 0, [a, b]), a="left", b="left")
    assert fates == {"a": ("", "", 0), "b": ("wall-collision", "", 1)}
    starving = snake("b", (0, 4), (0, 5), (0, 6), health=1)
    fates = play(Board(11, 11, 0, [snake("a", (1, 5), (2, 5), (3, 5)), starving]), a="left", b="down")
    assert fates == {"a": ("", "", 0), "b": ("out-of-health", "", 1)}


def test_who_dies_in_a_collision_still_blocks_and_kills():
    # a and b meet head on and die; c runs into b's body in the same turn.
    board = facing(3, 3)
    board.snakes.append(snake("c", (5, 4), (5, 3), (5, 2)))
    assert play(board, a="right", b="left", c="up")["c"] == ("snake-collision", "b", 8)


def test_the_longest_that_qualifies_is_the_one_who_did_it():
    # Three heads on (4, 5): lengths 3, 4, 5. Only the strictly longest lives.
    board = facing(3, 4)
    board.snakes.append(snake("c", (4, 4), (4, 3), (4, 2), (4, 1), (4, 0)))
    fates = play(board, a="right", b="left", c="up")
    assert fates["c"] == ("", "", 0)
    assert fates["a"][1] == fates["b"][1] == "c"


def test_one_health_lives_on_food_and_dies_of_a_hazard():
    def hungry(food, hazards):
        a = snake("a", (3, 5), (2, 5), (1, 5), health=1)
        board = Board(11, 11, 0, [a, snake("b", (9, 9), (9, 8), (9, 7))], food)
        board.hazards.update(hazards)
        return play(board, a="right", b="up")["a"], board.snakes[0].health

    assert hungry([(4, 5)], []) == (("", "", 0), 100)
    assert hungry([(4, 5)], [(4, 5)]) == (("", "", 0), 100)
    assert hungry([], []) == (("out-of-health", "", 1), 0)
    assert hungry([], [(4, 5)]) == (("hazard", "", 1), 0)


def test_stacked_hazards_bite_once_each_and_negative_damage_heals():
    def health_after(layers, damage):
        board = Board(11, 11, 0, [snake("a", (3, 5), (2, 5), (1, 5)), snake("b", (9, 9), (9, 8), (9, 7))])
        board.hazards[(4, 5)] = layers
        play(board, damage=damage, a="right", b="up")
        return board.snakes[0].health

    assert health_after(2, 14) == 50 - 1 - 28
    assert health_after(2, -30) == 100  # 49 + 60, but never above 100


def test_wrapped_heads_come_in_again_at_the_opposite_edge():
    board = Board(11, 7, 0, [snake("a", (10, 3), (9, 3), (8, 3)), snake("b", (5, 6), (5, 5), (5, 4))])
    play(board, "wrapped", a="right", b="up")
    assert [each.head for each in board.snakes] == [(0, 3), (5, 0)]


def test_constrictors_double_their_tails_from_the_second_move_on():
    referee = Referee(GameSettings(7, 7, 2, "constrictor", "empty"), StreamDice(3))
    lengths = []
    for _ in range(3):
        lengths.append(len(referee.board.snakes[0].body))
        safe = {each.id: "up" if each.head[1] < 3 else "down" for each in referee.board.snakes}
        if len(lengths) > 1:
            safe = {each.id: default_move(each.body, 7, 7) for each in referee.board.snakes}
        referee.turn(safe)
    assert lengths == [3, 3, 4]


def test_constrictors_start_without_food_on_any_map():
    assert Referee(GameSettings(7, 7, 2, "constrictor"), StreamDice(3)).board.food == []


def test_royale_hazards_close_in_by_one_side_at_a_time():
    board = Board(11, 11, 24, [snake("a", (3, 5), (2, 5), (1, 5)), snake("b", (9, 9), (9, 8), (9, 7))])
    play(board, "royale", a="right", b="up")
    assert set(board.hazards) == {(0, y) for y in range(11)}
    board.turn = 49
    play(board, "royale", a="right", b="left")
    assert set(board.hazards) == {(0, y) for y in range(11)} | {(x, 10) for x in range(11)}


def test_a_missing_move_is_refused():
    with pytest.raises(BoardError, match="snake b is alive and has no move"):
        play(facing(3, 3), a="up")


def test_a_chance_of_15_means_14_percent_and_the_minimum_is_filled_up():
    def fallen(roll, chance):
        board = Board(7, 7, 5, [snake("a", (3, 3), (3, 2), (3, 1))], [(0, 0)])
        standard_food_rule(board, GameSettings(7, 7, food_spawn_chance=chance), LoadedDice([roll]))
        return len(board.food) - 1

    assert sum(fallen(roll, 15) for roll in range(100)) == 14
    assert sum(fallen(roll, 100) for roll in range(100)) == 99
    assert sum(fallen(roll, 1) for roll in range(100)) == 0
    board = Board(7, 7, 5, [snake("a", (3, 3), (3, 2), (3, 1))])
    after_turn(board, GameSettings(7, 7, minimum_food=3), MapState(Plan(), []), LoadedDice())
    assert board.food == [(0, 0), (1, 0), (2, 0)]


def test_food_never_falls_beside_a_living_head_but_may_on_the_dead():
    dead = Snake("b", [(0, 0), (0, 1)], cause="hazard")
    board = Board(3, 3, 0, [snake("a", (2, 2), (2, 1), (2, 0)), dead])
    assert board.free_squares() == [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2)]


def test_a_game_of_several_ends_with_one_and_a_solo_game_with_none():
    board = Board(7, 7, 0, [snake("a", (1, 1), (1, 1), (1, 1)), Snake("b", [(0, 0)], cause="hazard")])
    assert is_over(board, GameSettings(7, 7))
    assert not is_over(board, GameSettings(7, 7, ruleset="solo"))
    assert not is_over(board, GameSettings(7, 7, solo=True))


def test_names_are_refused_with_the_nearest_known_one():
    with pytest.raises(BoardError, match="Did you mean 'royale'"):
        Referee(GameSettings(ruleset="royal"), StreamDice(1))
    with pytest.raises(BoardError, match="expected 11x11"):
        Referee(GameSettings(13, 13, map="hz_castle_wall"), StreamDice(1))


def test_who_says_no_move_goes_straight_on_with_two_squares_and_up_with_one():
    board = Board(11, 11, 7, [snake("a", (3, 3), (2, 3)), snake("b", (8, 7))])
    play(board, a="north", b="north")
    assert [each.head for each in board.snakes] == [(4, 3), (8, 8)]


@pytest.mark.parametrize("ruleset", ["standard", "royale", "wrapped"])
def test_nobody_hungers_moves_or_suffers_while_a_game_is_set_up(ruleset):
    board = Board(7, 7, 24, [snake("a", (1, 1), (1, 1), (1, 1)), snake("b", (5, 5), (5, 5), (5, 5))])
    board.hazards[(1, 1)] = 2
    before = board.copy()
    apply_rules(find_ruleset(ruleset), board, None, GameContext(GameSettings(7, 7, 2, ruleset), sides=[0, 1]))
    assert board == before


def test_what_a_finished_game_is_told_changes_nothing():
    referee = Referee(GameSettings(7, 7, 2, "standard", "empty"), StreamDice(3))
    first = referee.board.copy()
    board = referee.turn({"s0": "up", "s1": "up"})
    assert (board.turn, first.turn) == (1, 0)
    board.snakes[0].cause = "hazard"
    assert referee.over
    before = board.copy()
    assert referee.turn({"s1": "up"}) == before
