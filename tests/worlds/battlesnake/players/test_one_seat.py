"""One learner among players: the exam, Gymnasium's and PettingZoo's own checks, and what only this world promises."""

import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import racecraft.adapters  # noqa: F401  (registers the ids)
from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import SettingError
from racecraft.contract.world import allocate
from racecraft.worlds.battlesnake import adapter as battlesnake_v0
from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import RewardWeights, WorldSettings
from racecraft.worlds.battlesnake.players.gymnasium_env import one_seat_world
from racecraft.worlds.battlesnake.players.one_seat import OneSeatWorld, seats_for
from racecraft.worlds.battlesnake.players.protocol import PlayerError

ID = "racecraft/Battlesnake-v0"


class TestAgainstAnchors(WorldConformance):
    ticks = 120

    def make_world(self, num_worlds):
        game = WorldSettings(GameSettings(7, 7), num_worlds, max_turns=40, outlook=True)
        return OneSeatWorld(game, ("flood_fill", "random_safe"))


class TestAlone(WorldConformance):
    ticks = 60

    def make_world(self, num_worlds):
        return OneSeatWorld(WorldSettings(GameSettings(7, 7), num_worlds, max_turns=30), ())


class TestAgainstAReadablePlayer(WorldConformance):
    num_worlds = 2
    ticks = 40

    def make_world(self, num_worlds):
        return OneSeatWorld(WorldSettings(GameSettings(7, 7), num_worlds, max_turns=30), ("area_control",))


def test_a_death_begins_the_next_game_at_once_and_the_other_games_go_on():
    """Game 0 drives up into the wall; game 1 goes round a square of four."""
    world = one_seat_world(2, "flood_fill", width=7, height=7, snakes=3)
    buffers = allocate(world.spec)
    world.reset(buffers, 3)
    rounds = (2, 0, 3, 1)
    for turn in range(12):
        before = world.board(1)
        world.step(np.array([[0], [rounds[turn % 4]]]), buffers)
        if buffers.terminated[1, 0]:
            pytest.skip("the second snake died of its opponents; choose another seed")
        assert world.board(1).turn == before.turn + 1
        if buffers.terminated[0, 0]:
            break
    assert buffers.terminated[0, 0]
    assert buffers.reward[0, 0] == -1
    assert world.board(0).turn == 0
    assert len(world.board(0).alive()) == 3
    assert buffers.active.all()
    assert world.board(1).turn == turn + 1
    (told,) = world.pop_episodes()
    assert (told.world, told.agent) == (0, 0)
    assert told.status.endswith("collision")


def test_the_last_alive_wins():
    env = gymnasium.make(ID, opponents="random_safe", width=5, height=5, prizes={"win": 3, "food": 0.25})
    rewards = []
    env.action_space.seed(0)
    for seed in range(30):
        _, info = env.reset(seed=seed)
        over = False
        while not over:
            action = env.action_space.sample(mask=info["action_mask"])
            _, reward, terminated, truncated, info = env.step(action)
            over = terminated or truncated
            rewards.append(reward)
    assert {-1, 0, 3, 0.25} <= set(rewards), "lost, nothing, won, ate"


def test_gymnasium_finds_nothing_to_complain_of():
    env = gymnasium.make(ID, opponents=("hungry", "flood_fill"), outlook=True, render_mode="ansi")
    check_env(env.unwrapped, skip_render_check=False)
    env.reset(seed=1)
    assert "A" in env.render()
    assert env.observation_space["planes"].shape == (8, 21, 21)


def test_many_games_in_one_call_and_the_same_seed_tells_the_same_story():
    def story():
        envs = gymnasium.make_vec(
            ID, num_envs=16, vectorization_mode="vector_entry_point", opponents="hungry", snakes=4, width=7, height=7
        )
        _, info = envs.reset(seed=5)
        rng, told, ended = np.random.default_rng(0), [], 0
        for _ in range(60):
            liking = rng.random((16, 4)) * info["action_mask"]
            seen, reward, terminated, _, info = envs.step(liking.argmax(axis=-1))
            ended += int(terminated.sum())
            told.append((seen["planes"].sum(), seen["numbers"].sum(), reward.sum()))
        envs.close()
        return told, ended

    first = story()
    assert first == story()
    assert first[1] > 10


def test_opponents_move_as_the_players_of_their_names_do():
    world = one_seat_world(1, "flood_fill", width=9, height=9)
    twin = one_seat_world(1, "flood_fill", width=9, height=9)
    from racecraft.worlds.battlesnake.players.flood_fill import FloodFill

    buffers = allocate(world.spec)
    world.reset(buffers, 8)
    asked = 0
    for _ in range(25):
        board = world.board(0)
        expected = FloodFill().choose(board, world.inner.game_settings, "s1", 1.0)
        action = int(np.flatnonzero(buffers.action_mask[0, 0])[-1])
        world.step(np.array([[action]]), buffers)
        if buffers.ended.any():
            continue
        head, later = board.snakes[1].head, world.board(0).snakes[1].head
        step = {"up": (0, 1), "down": (0, -1), "left": (-1, 0), "right": (1, 0)}[expected]
        assert later == (head[0] + step[0], head[1] + step[1])
        asked += 1
    assert asked > 10
    twin.close()


@pytest.mark.skipif(sys.platform == "win32", reason="processes of files are ended by group here")
def test_a_file_of_ones_own_sits_at_the_board(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text("def move(data):\n    return 'left'\n")
    world = one_seat_world(1, str(path), width=7, height=7)
    buffers = allocate(world.spec)
    world.reset(buffers, 2)
    before = world.board(0).snakes[1].head
    world.step(np.array([[int(np.flatnonzero(buffers.action_mask[0, 0])[0])]]), buffers)
    assert world.board(0).snakes[1].head == (before[0] - 1, before[1])
    world.close()


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"opponents": "flod_fill"}, PlayerError, "flood_fill"),
        ({"width": 99}, BoardError, "width"),
        ({"prizes": {"wins": 1}}, SettingError, "win"),
        ({"snakes": 3, "opponents": ()}, SettingError, "opponents"),
        ({"snakes": 2, "opponents": ("hungry",) * 3}, SettingError, "3 opponents"),
        ({"render_mode": "human"}, SettingError, "ansi"),
    ],
)
def test_what_cannot_be_made_is_refused(options, error, words):
    from racecraft.worlds.battlesnake.players.gymnasium_env import SnakeEnv

    with pytest.raises(error, match=words):
        SnakeEnv(**options)


def test_opponents_are_repeated_in_turn():
    assert seats_for(("hungry", "flood_fill"), 4) == ("hungry", "flood_fill", "hungry")
    assert seats_for("hungry", 1) == ()


@pytest.mark.filterwarnings("ignore:Observation", "ignore:Could not run tests on", "ignore:The NumPy array")
def test_all_seats_are_open_to_pettingzoo():
    pytest.importorskip("pettingzoo")
    from pettingzoo.test import api_test, parallel_api_test

    parallel_api_test(battlesnake_v0.parallel_env(width=7, height=7, snakes=3, max_turns=50), num_cycles=200)
    api_test(battlesnake_v0.env(width=7, height=7, snakes=2, max_turns=50), num_cycles=50)
    with pytest.raises(SettingError, match="loss"):
        battlesnake_v0.parallel_env(prizes={"los": 1})


def test_prizes_reach_the_pettingzoo_game():
    pytest.importorskip("pettingzoo")
    env = battlesnake_v0.parallel_env(width=7, height=7, snakes=2, prizes={"turn": 0.125})
    env.reset(seed=1)
    _, rewards, *_ = env.step({"agent_0": 0, "agent_1": 0})
    assert rewards == {"agent_0": 0.125, "agent_1": 0.125}
    assert RewardWeights().turn == 0
