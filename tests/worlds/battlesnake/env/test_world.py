"""The exam, and what this world promises beyond it."""

import dataclasses

import numpy as np
import pytest

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.world import allocate
from racecraft.kernels import set_threads, threads
from racecraft.worlds.battlesnake.env.board import MOVES, STEPS, Board, BoardError, Snake
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.observation import PLANES, observe_board
from racecraft.worlds.battlesnake.env.reference import Referee, apply_rules
from racecraft.worlds.battlesnake.env.rulesets import is_over
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.solo_maze import level_of
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, RewardWeights, WorldSettings


class TestStandardWorld(WorldConformance):
    ticks = 120

    def make_world(self, num_worlds):
        return BattlesnakeWorld(WorldSettings(GameSettings(7, 7, 3), num_worlds, max_turns=40))


class TestRoyaleOnAPlannedMap(WorldConformance):
    ticks = 60

    def make_world(self, num_worlds):
        game = GameSettings(11, 11, 4, "wrapped", "hz_spiral", hazard_damage=30)
        return BattlesnakeWorld(WorldSettings(game, num_worlds, max_turns=25, view=9))


class TestSoloMazeWorld(WorldConformance):
    ticks = 60

    def make_world(self, num_worlds):
        game = GameSettings(7, 7, 1, "solo", "solo_maze", hazard_damage=100)
        return BattlesnakeWorld(WorldSettings(game, num_worlds))


def stepped(settings, ticks, seed=3):
    """Play random safe moves; yield world, buffers and the actions of the step just made."""
    world = BattlesnakeWorld(settings)
    buffers, rng = allocate(world.spec), np.random.default_rng(seed)
    world.reset(buffers, seed)
    for _ in range(ticks):
        liking = rng.random(buffers.action_mask.shape) * buffers.action_mask
        actions = liking.argmax(axis=-1)
        world.step(actions, buffers)
        yield world, buffers, actions


def test_a_solo_maze_in_training_is_the_referees_roll_for_roll():
    """Games side by side, each with dice of its own, until they end; some come to a second level."""
    game = GameSettings(11, 11, 1, "solo", "solo_maze", hazard_damage=100)
    world = BattlesnakeWorld(WorldSettings(game, 8))
    buffers, rng = allocate(world.spec), np.random.default_rng(1)
    world.reset(buffers, 5)
    referees = [Referee(game, StreamDice(int(key))) for key in world.games.chance[:, 0]]
    levels, going = set(), [True] * 8
    for _ in range(100):
        actions = np.zeros((8, 1), np.int64)
        for g in range(8):  # mostly the allowed way that ends nearest to the food
            board = world.board(g)
            (x, y), (food_x, food_y) = board.snakes[0].head, board.food[0]
            far = [abs(x + dx - food_x) + abs(y + dy - food_y) for dx, dy in STEPS]
            unlike = np.array(far) + 3.0 * rng.random(4) + 99.0 * ~buffers.action_mask[g, 0]
            actions[g, 0] = unlike.argmin()
        world.step(actions, buffers)
        for g, referee in enumerate(referees):
            referee.turn({"s0": MOVES[int(actions[g, 0])]})
            going[g] &= not referee.over
            if going[g]:
                assert world.board(g).food == referee.board.food
                assert world.board(g).hazards == referee.board.hazards
                levels.add(level_of(referee.board))
    assert {0, 1} <= levels


@pytest.mark.parametrize("ruleset", ["standard", "wrapped", "constrictor"])
def test_one_board_shows_the_same_as_the_world_of_training(ruleset):
    settings = WorldSettings(GameSettings(11, 11, 4, ruleset, "hz_columns"), 4)
    for world, buffers, _ in stepped(settings, 60):
        board = world.board(2)
        listed = dataclasses.replace(board, snakes=board.alive())  # servers leave out the eliminated
        for snake in listed.snakes:
            seen, mask = observe_board(listed, settings.game, snake.id)
            number = int(snake.id[1:])
            for name, array in seen.items():
                np.testing.assert_array_equal(array, buffers.observations[name][2, number])
            np.testing.assert_array_equal(mask, buffers.action_mask[2, number])


@pytest.mark.parametrize(("width", "height", "map_id"), [(11, 11, "hz_columns"), (7, 9, "standard"), (9, 5, "empty")])
def test_a_window_that_holds_the_board_shows_what_a_smaller_one_does(width, height, map_id):
    """They are drawn in two ways, `sheet.py` and `observe.py`: the smaller one is the middle of the larger."""
    side, unlike = 2 * max(width, height) - 1, 0
    settings = WorldSettings(GameSettings(width, height, 4, map=map_id, minimum_food=5), 4)
    for world, _, _ in stepped(settings, 40):
        board = world.board(1)
        for snake in board.alive():
            whole = observe_board(board, settings.game, snake.id, view=side)[0]["planes"]
            small = observe_board(board, settings.game, snake.id, view=side - 2)[0]["planes"]
            np.testing.assert_array_equal(whole[:, 1:-1, 1:-1], small)
            unlike += whole[PLANES.index("own_body")].any() and whole[PLANES.index("other_bodies")].any()
    assert unlike


def test_what_a_snake_sees_can_be_read_off_the_board():
    me = Snake("me", [(1, 1), (1, 0), (0, 0)], 80)
    you = Snake("you", [(3, 1), (3, 2), (3, 3), (3, 3)], 60)
    board = Board(7, 7, 4, [me, you], [(2, 2)])
    board.hazards[(0, 1)] = 2
    seen, mask = observe_board(board, GameSettings(7, 7, 2), "me", view=5)
    plane = dict(zip(PLANES, seen["planes"], strict=True))
    assert plane["own_body"][2, 2] == 24  # the head, in the middle: three turns
    assert plane["own_body"][3].tolist() == [0, 8, 16, 0, 0]  # the row below: tail left, neck under the head
    assert plane["other_bodies"][:, 4].tolist() == [16, 24, 32, 0, 0]  # the doubled tail clears in two turns
    assert plane["stronger_heads"][2, 4] == 127 + 16
    assert plane["weaker_heads"].sum() == 0
    assert plane["healths"][2, 2] == 200
    assert plane["healths"][2, 4] == 150
    assert plane["food"][1, 3] == 255
    assert plane["hazards"][2, 1] == 2 * 14 * 5 // 2
    assert plane["walls"][4].tolist() == [255] * 5  # y = -1
    assert plane["walls"][:, 0].tolist() == [255] * 5  # x = -1
    assert plane["walls"][:4, 1:].sum() == 0
    assert mask.tolist() == [True, False, True, True]  # its neck is below
    assert seen["numbers"][:4].tolist() == pytest.approx([0.8, 3 / 49, -0.1, 1 / 16])


def test_the_mask_frees_a_leaving_tail_and_all_moves_where_all_are_fatal():
    corner = Snake("a", [(0, 0), (0, 1), (1, 1), (1, 0)])
    board = Board(7, 7, 3, [corner])
    _, mask = observe_board(board, GameSettings(7, 7, 1), "a")
    assert mask.tolist() == [False, False, False, True]
    corner.body.append((1, 0))  # it just ate
    _, mask = observe_board(board, GameSettings(7, 7, 1), "a")
    assert mask.all()


def not_surely_fatal(board, snake, wrapped):
    """Say of the four moves what a person would: on the board, and no body there but a tail that moves away."""
    ways = []
    for dx, dy in STEPS:
        x, y = snake.head[0] + dx, snake.head[1] + dy
        x, y = (x % board.width, y % board.height) if wrapped else (x, y)
        lying = [other for other in board.alive() if (x, y) in other.body]
        leaving = [other.body.index((x, y)) == len(other.body) - 1 for other in lying]
        ways.append(board.holds((x, y)) and all(leaving))
    return ways if any(ways) else [True] * 4


@pytest.mark.parametrize("ruleset", ["standard", "wrapped"])
def test_the_mask_is_what_a_person_would_say(ruleset):
    edges = 0
    for world, buffers, _ in stepped(WorldSettings(GameSettings(7, 5, 4, ruleset), 8), 60):
        for number in range(8):
            board = world.board(number)
            for m, snake in enumerate(board.snakes):
                if snake.alive:
                    expected = not_surely_fatal(board, snake, ruleset == "wrapped")
                    assert buffers.action_mask[number, m].tolist() == expected
                    edges += snake.head[1] == 4 and expected[0] and not all(expected)
    assert (edges > 10) == (ruleset == "wrapped")


def test_overlapping_snakes_and_strangers_are_refused():
    board = Board(7, 7, 0, [Snake("a", [(1, 1), (1, 2)]), Snake("b", [(1, 2), (2, 2)])])
    with pytest.raises(BoardError, match="on another living snake"):
        observe_board(board, GameSettings(7, 7, 2), "a")
    with pytest.raises(BoardError, match="no snake 'c'"):
        observe_board(board, GameSettings(7, 7, 2), "c")
    with pytest.raises(BoardError, match="food at"):
        observe_board(Board(7, 7, 0, [Snake("a", [(1, 1), (1, 2)])], [(7, 0)]), GameSettings(7, 7, 1), "a")
    with pytest.raises(BoardError, match="the board is 7x7"):
        observe_board(board, GameSettings(11, 11, 2), "a")
    with pytest.raises(BoardError, match="odd number"):
        BattlesnakeWorld(WorldSettings(view=8))


def test_threads_do_not_change_the_story():
    before = threads()
    stories = []
    for count in (1, 2):
        set_threads(count)
        settings = WorldSettings(GameSettings(11, 11, 4), 130)
        stories.append([buffers.observations["planes"].copy() for _, buffers, _ in stepped(settings, 20)][-1])
    set_threads(before)
    np.testing.assert_array_equal(*stories)


def test_episodes_tell_what_the_referee_counts():
    """Length, food, kills, turns, cause and pay of every episode, by the readable rules from the same positions."""
    game, prizes = (
        GameSettings(7, 7, 4, minimum_food=3),
        RewardWeights(turn=0.125, food=0.5, kill=0.25, win=8.0, loss=-4.0),
    )
    world = BattlesnakeWorld(WorldSettings(game, 8, max_turns=40, prizes=prizes))
    buffers, rng, referee = allocate(world.spec), np.random.default_rng(1), Referee(game, StreamDice(0))
    world.reset(buffers, 1)
    counted, kills = np.zeros((8, 4, 3)), 0
    for _ in range(250):
        actions = (rng.random(buffers.action_mask.shape) * buffers.action_mask).argmax(axis=-1)
        boards = [world.board(number) for number in range(8)]
        world.step(actions, buffers)
        told = {(one.world, one.agent): one for one in world.pop_episodes()}
        for number, before in enumerate(boards):
            after, alive = before.copy(), [snake.alive for snake in before.snakes]
            moves = {snake.id: MOVES[actions[number, m]] for m, snake in enumerate(before.snakes) if snake.alive}
            apply_rules(referee.rules, after, moves, referee.table)
            over = is_over(after, game)
            for m in np.flatnonzero(alive):
                snake = after.snakes[m]
                ate = len(snake.body) - len(before.snakes[m].body)
                slain = sum(
                    alive[n] and other.by == snake.id != other.id and "collision" in other.cause
                    for n, other in enumerate(after.snakes)
                )
                pay = prizes.loss if snake.cause else prizes.win if over else prizes.turn
                counted[number, m] += (pay + prizes.food * ate + prizes.kill * slain, ate, slain)
                kills += slain
                if (record := told.pop((number, m), None)) is not None:
                    status = snake.cause or ("won" if over else "truncated")
                    assert (record.status, record.steps) == (status, before.turn + 1)
                    reward, ate, slain = counted[number, m]
                    assert record.facts == {"length": len(snake.body), "food_eaten": ate, "kills": slain}
                    assert record.reward == reward
                    counted[number, m] = 0
                else:
                    assert not snake.cause
                    assert not over
                    assert before.turn + 1 < 40
        assert not told
    assert kills > 20


def test_unless_told_otherwise_a_won_game_pays_one_a_lost_one_costs_one_and_nothing_else_counts():
    paid = {
        (one.status == "won", one.reward)
        for world, _, _ in stepped(WorldSettings(GameSettings(7, 7, 3), 8), 200)
        for one in world.pop_episodes()
    }
    assert paid == {(True, 1.0), (False, -1.0)}


def test_the_dead_wait_for_the_next_game():
    settings = WorldSettings(GameSettings(11, 11, 4), 8)
    waited = False
    active = np.ones((8, 4), bool)
    for _, buffers, _ in stepped(settings, 300):
        assert not buffers.ended[~active].any()
        assert (buffers.reward[~active] == 0).all()
        blind = ~buffers.active
        assert buffers.observations["planes"][blind].sum() == 0
        waited |= bool(blind.any())
        active = buffers.active.copy()
    assert waited


@pytest.mark.parametrize(("words", "letter"), [({"num_games": 0}, "num_games 0"), ({"max_turns": -1}, "max_turns -1")])
def test_worlds_without_games_or_before_their_beginning_are_refused(words, letter):
    with pytest.raises(BoardError, match=f"{letter}.*; expected at least 1 and 0"):
        BattlesnakeWorld(WorldSettings(**words))
    assert BattlesnakeWorld(WorldSettings(num_games=1, max_turns=0)).spec.num_worlds == 1


def test_a_map_is_asked_whether_it_can_be_played():
    with pytest.raises(BoardError, match="map solo_maze with 4 snakes"):
        BattlesnakeWorld(WorldSettings(GameSettings(map="solo_maze"), 1))


@pytest.mark.parametrize(
    ("words", "is_compiled", "hazards"),
    [
        ({}, True, 0),
        ({"width": 7, "height": 7, "players": 8}, True, 0),
        ({"map": "snail_mode"}, True, 0),
        ({"map": "hz_rings"}, True, 4 * 8 + 4 * 4),
        ({"width": 6, "height": 6}, False, 0),
        ({"players": 9}, False, 0),
        ({"map": "hz_spiral"}, False, 0),
        ({"width": 7, "height": 7, "players": 1, "map": "solo_maze"}, False, 0),
    ],
)
def test_common_games_are_set_up_by_the_kernel_and_stand_as_the_referee_sets_them_up(words, is_compiled, hazards):
    game = GameSettings(**words)
    world = BattlesnakeWorld(WorldSettings(game, 2))
    assert world._compiled_set_up == is_compiled
    assert world.start_hazards.sum() == hazards
    assert world.start_hazards.shape == (game.area,)
    buffers = allocate(world.spec)
    world.reset(buffers, 9)
    for number, key in enumerate(world.games.chance[:, 0]):
        referee = Referee(game, StreamDice(int(key)))
        board = world.board(number)
        assert board.snakes == referee.board.snakes
        assert sorted(board.food) == sorted(referee.board.food)
        assert board.hazards == +referee.board.hazards
        assert world.games.chance[number, 1] == referee.dice.counter


def test_a_game_that_is_broken_off_tells_nothing_and_the_others_go_on():
    world = BattlesnakeWorld(WorldSettings(GameSettings(7, 7, 2), 3, prizes=RewardWeights(turn=0.5)))
    buffers = allocate(world.spec)
    world.reset(buffers, 2)
    world.step(np.array([[0, 0]] * 3), buffers)
    before = [world.board(number) for number in range(3)]
    world.begin_games(np.array([False, True, False]), buffers)
    assert world.pop_episodes() == []
    after = [world.board(number) for number in range(3)]
    assert [after[number] == before[number] for number in range(3)] == [True, False, True]
    assert [board.turn for board in after] == [1, 0, 1]
    assert buffers.active.all()
    while not world.pop_episodes():
        world.step(np.array([[0, 0]] * 3), buffers)


def test_what_was_earned_is_saved_and_what_was_told_is_not():
    settings = WorldSettings(GameSettings(7, 7, 2), 4, max_turns=3, prizes=RewardWeights(turn=1.0, win=1.0, loss=1.0))
    world, other = BattlesnakeWorld(settings), BattlesnakeWorld(settings)
    one, two = allocate(world.spec), allocate(world.spec)
    world.reset(one, 5)
    other.reset(two, 6)
    for _ in range(3):
        other.step(one.action_mask.argmax(axis=-1), two)
    world.step(one.action_mask.argmax(axis=-1), one)
    state = world.save_state()
    other.load_state(state, two)
    assert other.pop_episodes() == []
    np.testing.assert_array_equal(two.observations["planes"], one.observations["planes"])
    for _ in range(2):
        other.step(two.action_mask.argmax(axis=-1), two)
    told = other.pop_episodes()
    assert len(told) >= 4
    assert all(one.reward == one.steps for one in told), "one a turn, the first turn too"
    assert {one.status for one in told if one.steps == 3} == {"truncated"}
    assert other.pop_episodes() == []
