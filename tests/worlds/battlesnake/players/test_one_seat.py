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
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import WorldSettings
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
