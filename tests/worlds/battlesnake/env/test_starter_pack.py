"""The starter pack's gym: its surface, its habits, and the figures measured in the original (facts D.3)."""

from dataclasses import asdict

import numpy as np
import pytest

from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.starter_pack import (
    REWARDS_APRIL_2020,
    REWARDS_FEBRUARY_2020,
    REWARDS_MAY_2020,
    Rewards,
    StarterPackGym,
    source_experiment,
)

UP = 0


def request(*bodies, food=(), side=7):
    """An official request body; squares are (x, y), y upward."""

    def points(squares):
        return [{"x": x, "y": y} for x, y in squares]

    snakes = [{"id": str(n), "health": 90, "body": points(body)} for n, body in enumerate(bodies)]
    return {"turn": 5, "board": {"height": side, "width": side, "food": points(food), "snakes": snakes}}


def test_heads_are_5_or_the_length_and_rows_count_downward():
    start = request([(1, 6), (1, 5), (1, 4)], food=[(0, 0)])
    flat = StarterPackGym("flat-51s", (7, 7), initial_game_state=start, initial_y="up").reset()[0]
    assert flat[:, 1, 1].tolist() == [5, 1, 1, 0, 0, 0, 0]
    assert flat[6, 0, 0] == 1
    number = StarterPackGym("flat-num", (7, 7), initial_game_state=start, row_order="up", initial_y="up").reset()[0]
    assert number[:, 1, 1].tolist() == [0, 0, 0, 0, 1, 2, 3]


@pytest.mark.parametrize("side", [7, 11, 19])
def test_the_published_experiment_is_one_word(side):
    gym = source_experiment(side, seed=2)
    state, masks, dones, _ = gym.reset()
    assert state.shape == (21, 21, 6)
    assert len(dones) == 5
    assert masks == {}, "no mask: every action may be taken, also a fatal one"
    assert gym.rewards == Rewards(another_turn=0.05, won=5, died=-1, forbidden_move=-1)
    frame = (21 - side) // 2
    assert (state[:frame] == -1).all()
    assert (state[frame, frame : 21 - frame] >= 0).all()


def test_what_is_paid_is_what_the_pack_paid_at_each_date():
    """Its history, February to May 2020 (facts: rewards of the starter pack)."""
    for rewards, paid in (
        (REWARDS_FEBRUARY_2020, {"another_turn": 1, "won": 2, "died": -3, "forbidden_move": -1}),
        (REWARDS_APRIL_2020, {"another_turn": 0.05, "won": 5, "died": -1, "forbidden_move": -1}),
        (REWARDS_MAY_2020, {"another_turn": 1}),
    ):
        assert {name: price for name, price in asdict(rewards).items() if price} == paid


def test_unknown_names_are_refused():
    with pytest.raises(BoardError, match="Did you mean 'starved'"):
        StarterPackGym(rewards={"starve": 1})
    with pytest.raises(BoardError, match="Did you mean 'flat-51s'"):
        StarterPackGym("flat51s")


def choose(gym, how, rng):
    if how == "uniform":
        return rng.integers(0, 4, len(gym.snakes))
    if how == "no reverse":
        return [int(rng.choice([a for a in range(4) if s.facing is None or a != s.facing ^ 1])) for s in gym.snakes]
    taken = {square for snake in gym.snakes if snake.alive for square in snake.body}
    return [safe_action(gym, snake, taken, rng) if snake.alive else 0 for snake in gym.snakes]


def safe_action(gym, snake, taken, rng):
    row, column = snake.body[0]
    around = ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1))
    rows, columns = gym.map_size
    free = [a for a, s in enumerate(around) if s not in taken and 0 <= s[0] < rows and 0 <= s[1] < columns]
    return int(rng.choice(free)) if free else int(rng.integers(4))


def calibrate(side, how, games, rewards):
    """Return the mean length of an episode and the mean reward, summed over five snakes."""
    gym = StarterPackGym("flat-51s", (side, side), 5, rewards=rewards, seed=side)
    gym._state = lambda: None  # nobody looks; ten times as fast
    lengths, pay, rng = [], [], np.random.default_rng(side)
    for _ in range(games):
        gym.reset()
        total = 0.0
        while not gym.over:
            _, paid, _, _ = gym.step(choose(gym, how, rng))
            total += sum(paid.values())
        lengths.append(gym.turn)
        pay.append(total)
    return float(np.mean(lengths)), float(np.mean(pay))


@pytest.mark.parametrize(
    ("side", "how", "games", "rewards", "length", "reward"),
    [
        (11, "uniform", 400, REWARDS_MAY_2020, 4.4, 11.2),
        (11, "no reverse", 300, REWARDS_APRIL_2020, 12.4, 2.37),
        (7, "safe", 300, REWARDS_FEBRUARY_2020, 41.0, 98.0),  # the original again, 250 games: 41.0 ± 1.8
    ],
)
def test_random_play_comes_to_the_figures_of_the_original(side, how, games, rewards, length, reward):
    assert calibrate(side, how, games, rewards) == (pytest.approx(length, rel=0.1), pytest.approx(reward, rel=0.1))


@pytest.mark.long
@pytest.mark.parametrize(("side", "length", "reward"), [(11, 102, 288), (15, 165, 500), (19, 177, 572)])
def test_safe_random_play_comes_to_the_figures_of_the_original(side, length, reward):
    found = calibrate(side, "safe", 400, REWARDS_FEBRUARY_2020)
    assert found == (pytest.approx(length, rel=0.1), pytest.approx(reward, rel=0.1))


def test_a_gym_of_which_nothing_is_told_is_the_packs_own():
    gym = StarterPackGym()
    assert gym.reset()[0].shape == gym.observation_shape == (15, 15, 5)
    assert (gym.observation_type, gym.row_order, gym.rewards) == ("flat-51s", "down", REWARDS_MAY_2020)
    assert source_experiment().map_size == (11, 11)
    assert [len(snake.body) for snake in gym.snakes] == [1, 1, 1, 1]
    assert len(gym.food) == 1


@pytest.mark.parametrize(
    ("words", "letter"),
    [
        ({"row_order": "sideways"}, "row_order is 'sideways'; expected 'down' or 'up'"),
        ({"map_size": (9, 22)}, "expected 1 to 16 on 3 to 21"),
        ({"snake_spawn_locations": [(1, 1)]}, "1 spawn locations for 4 snakes; expected one each, or none"),
        ({"rewards": 5}, "rewards is a int; expected a dictionary or an object with get_reward"),
    ],
)
def test_a_gym_that_cannot_be_played_is_refused(words, letter):
    with pytest.raises(BoardError, match=letter):
        StarterPackGym(**words)


def test_a_state_of_another_size_is_refused():
    wide = request([(1, 1), (1, 2)])
    wide["board"]["width"] = 9
    with pytest.raises(BoardError, match=r"the state is 7x9; expected \(7, 7\)"):
        StarterPackGym("flat-51s", (7, 7), initial_game_state=wide).reset()


def test_a_state_that_tells_no_turn_is_at_its_beginning_and_a_snake_without_a_body_is_dead():
    start = request([(1, 1), (1, 2)], [], [(5, 5)])
    gym = StarterPackGym("flat-51s", (7, 7), initial_game_state=start)
    assert gym.reset()[3]["current_turn"] == 5
    assert [snake.alive for snake in gym.snakes] == [True, False, True]
    assert [snake.facing for snake in gym.snakes] == [UP, None, None], "y counts downward here: the neck lies below"
    del start["turn"]
    assert gym.reset()[3] == {
        "current_turn": 0,
        "snake_health": {0: 90, 1: 90, 2: 90},
        "snake_info": dict.fromkeys(range(3), "Did not collide"),
        "snake_max_len": {0: 0, 1: 0, 2: 0},
    }


def test_foods_to_come_are_used_up_before_chance_takes_over():
    """A food falls in 15 of 100 turns; the same squares come again in the next game."""
    spots = [(2, 3), (4, 4), (1, 6)]
    gym = StarterPackGym("flat-51s", (7, 7), 1, [(6, 0)], food_spawn_locations=spots, seed=3)
    for _ in range(2):
        gym.reset()
        told = [set(gym.food)]
        while len(gym.food) < 4:
            gym.step([UP])
            if gym.food != told[-1]:
                told.append(set(gym.food))
        assert told[:3] == [set(spots[: count + 1]) for count in range(3)]
        assert len(told[3] - set(spots)) == 1


def test_a_bordered_board_lies_in_the_middle_of_its_frame_whichever_way_its_rows_run():
    start = request([(1, 6), (1, 5)], food=[(0, 0)], side=7)
    for order, row in (("down", 0), ("up", 6)):
        options = {"initial_game_state": start, "initial_y": "up", "row_order": order}
        for name, frame in (("bordered-51s", 1), ("max-bordered-51s", 7)):
            state = StarterPackGym(name, (7, 7), **options).reset()[0]
            assert (state[..., 1] == 5).sum() == 1
            assert state[frame + row, frame + 1, 1] == 5
            assert state[frame + 6 - row, frame, 0] == 1
            assert (state == -1).sum() == 2 * (len(state) ** 2 - 49)
            assert state.dtype == np.float64


def test_snakes_without_a_place_begin_on_different_squares_of_the_whole_board():
    begun = set()
    for seed in range(60):
        gym = StarterPackGym("flat-51s", (3, 5), 6, seed=seed)
        gym.reset()
        heads = [snake.body[0] for snake in gym.snakes]
        assert len(set(heads)) == 6
        assert not gym.food & set(heads)
        begun.update(heads)
    assert begun == {(row, column) for row in range(3) for column in range(5)}


def test_a_full_board_is_given_no_food():
    gym = StarterPackGym("flat-51s", (3, 3), 9)
    gym.reset()
    assert gym.food == set()
