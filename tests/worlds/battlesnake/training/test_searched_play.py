"""Learning by search: what the world shows, how a page of updates reads it, and a training from end to end."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.alphazero import SEARCHED, AlphaZeroConfig, AlphaZeroLearner
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec, allocate
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.overrides import with_values
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.battlesnake.env.board import MOVES, Board, Snake
from racecraft.worlds.battlesnake.env.observation import observe_board
from racecraft.worlds.battlesnake.env.settings import GameSettings, SnakeConfig
from racecraft.worlds.battlesnake.env.world import WorldSettings
from racecraft.worlds.battlesnake.players.find import find_player
from racecraft.worlds.battlesnake.players.network_tree import Network
from racecraft.worlds.battlesnake.players.protocol import PlayerError
from racecraft.worlds.battlesnake.training.searched_play import SearchedWorld
from racecraft.worlds.battlesnake.training.self_play import SelfPlayWorld, world_settings
from racecraft.worlds.battlesnake.training.settings import SearchConfig, SelfPlayConfig
from racecraft.worlds.battlesnake.training.symmetries import SYMMETRIES, turned
from racecraft.worlds.battlesnake.training.trainer import SnakeRequest, default_settings


class Even:
    """A policy that thinks all moves alike, and a critic without hope or fear; the same for a row whoever is beside."""

    def evaluate(self, observations, action_mask=None):
        rows = len(action_mask)
        return np.full((rows, 4), 0.25, np.float32), np.zeros(rows, np.float32)


class FirstAllowed:
    """Takes the first move that is allowed."""

    def begin(self, seed): ...

    def reset_state(self, rows): ...

    def act(self, observations, action_mask=None):
        return action_mask.argmax(axis=1)


def searched_world(num_games=6, seats=3, **config):
    shares = {"anchor_share": 0.34, "pool_share": 0.17} | config
    played = world_settings(
        WorldSettings(GameSettings(7, 7, seats)), SnakeConfig(view=5, outlook=False, max_turns=30), num_games
    )
    world = SearchedWorld(SelfPlayWorld(played, SelfPlayConfig(**shares)), SearchConfig(walks=8))
    world.meet(FirstAllowed())
    world.ask(Network(Even(), SnakeConfig(view=5, outlook=False)))
    return world


class TestSearchedPlaySitsTheExam(WorldConformance):
    ticks = 40

    def make_world(self, num_worlds):
        return searched_world()


def test_every_living_seat_of_the_learners_is_shown_a_search_and_no_other():
    world = searched_world()
    buffers = allocate(world.spec)
    world.reset(buffers, 3)
    for _ in range(25):
        shares = buffers.observations[SEARCHED][:, 0]
        active = buffers.active[:, 0]
        assert shares[active].sum(axis=1) == pytest.approx(1.0)
        assert (shares[~active] == 0).all()
        several = active & (buffers.action_mask[:, 0].sum(axis=1) < 4)
        assert (shares[several][~buffers.action_mask[several, 0]] == 0).all(), "no walk into what is surely fatal"
        world.step(shares.argmax(axis=1)[:, None], buffers)
    world.close()


def test_searched_games_go_on_from_a_saved_state_bit_by_bit():
    world = searched_world()
    buffers = allocate(world.spec)
    world.reset(buffers, 5)
    for _ in range(4):
        world.step(buffers.observations[SEARCHED].argmax(axis=2), buffers)
    state, told = world.save_state(), []
    for _ in range(2):
        world.load_state(state, buffers)
        for _ in range(6):
            world.step(buffers.observations[SEARCHED].argmax(axis=2), buffers)
        told.append({name: array.copy() for name, array in buffers.observations.items()})
    assert all(np.array_equal(told[0][name], told[1][name]) for name in told[0])


def position(move_of, width=7, height=9):
    """Return a board, or its image under a map of squares."""
    snakes = [
        Snake("a", [move_of(*one) for one in [(2, 3), (2, 4), (3, 4), (3, 5)]], 71),
        Snake("b", [move_of(*one) for one in [(4, 2), (5, 2), (5, 1)]], 40),
    ]
    wide, high = (width, height) if move_of(1, 0)[1] == move_of(0, 0)[1] else (height, width)
    return Board(wide, high, 12, snakes, [move_of(6, 8), move_of(2, 2)], {move_of(1, 3): 1})


@pytest.mark.parametrize("ruleset", ["royale", "wrapped"])
@pytest.mark.parametrize("number", range(7))
def test_a_turned_row_is_what_a_turned_board_shows(number, ruleset):
    quarters, mirrored = SYMMETRIES[number].keywords["quarters"], SYMMETRIES[number].keywords["mirrored"]

    def image(x, y):
        wide, high = 7, 9
        if mirrored:
            x = wide - 1 - x
        for _ in range(quarters):
            x, y, wide, high = high - 1 - y, x, high, wide
        return x, y

    plain, other = position(lambda x, y: (x, y)), position(image)
    seen, mask = observe_board(plain, GameSettings(7, 9, 2, ruleset), "a", 9, True)
    there, mask_there = observe_board(other, GameSettings(other.width, other.height, 2, ruleset), "a", 9, True)
    rows = {name: torch.from_numpy(array)[None] for name, array in (seen | {"action_mask": mask}).items()}
    found = turned(rows, quarters, mirrored)
    assert np.array_equal(found["planes"][0], there["planes"])
    assert np.array_equal(found["action_mask"][0], mask_there)
    assert np.allclose(found["outlook"][0], there["outlook"])
    assert np.array_equal(found["numbers"][0], there["numbers"])


def toy_spec(searched=True):
    seen = {"position": ArraySpec((2,), np.float32)}
    if searched:
        seen[SEARCHED] = ArraySpec((3,), np.float32, 0.0, 1.0, privileged=True)
    return WorldSpec("toy", 4, 1, seen, DiscreteActions(3))


def toy_learner(**config):
    settings = with_values(default_settings(find_algorithm("alphazero")), "network", {"hidden_units": (16,)})
    return AlphaZeroLearner(toy_spec(), settings.network, AlphaZeroConfig(**config), seed=1)


def test_it_learns_what_was_searched_and_what_came_of_it():
    learner, rng = (
        toy_learner(learning_rate=1e-2, epochs=60, batch_size=64, discount=1.0, outcome_lambda=1.0),
        (np.random.default_rng(0)),
    )
    side = rng.integers(0, 2, (32, 4))
    shown = np.stack([side, 1 - side], axis=-1).astype(np.float32)
    searched = np.where(side[..., None] == 0, np.float32([0.1, 0.9, 0.0]), np.float32([0.0, 0.2, 0.8]))
    reward = np.where(side == 0, 1.0, -1.0).astype(np.float32)
    ended = np.ones((32, 4), bool)
    batch = RolloutBatch(
        observations={"position": shown, SEARCHED: searched}, actions=np.zeros((32, 4), np.int64), reward=reward,
        terminated=ended, truncated=~ended, active=ended,
        last_observations={"position": shown[-1], SEARCHED: searched[-1]}, last_active=ended[0],
    )  # fmt: skip
    told = learner.update(batch)
    chances, values = learner.policy.evaluate({"position": np.float32([[0, 1], [1, 0]])})
    assert chances == pytest.approx(np.array([[0.1, 0.9, 0.0], [0.0, 0.2, 0.8]]), abs=0.06)
    assert values == pytest.approx([1.0, -1.0], abs=0.1)
    assert told["transitions"] == 128


DUEL = GameSettings(7, 7, 2)
NETWORK = ("network.image_units=16", "network.hidden_units=32", "snake.view=5", "snake.max_turns=40")
SMALL = (
    *NETWORK, "rollout.num_worlds=8", "rollout.horizon=8", "search.walks=6", "alphazero.batch_size=64",
    "evaluation.every=2", "evaluation.episodes=2", "runtime.threads=1",
)  # fmt: skip


class Quiet(NullCallback):
    """A listener that keeps the figures."""

    def __init__(self):
        self.told = []

    def iteration(self, report):
        self.told.append((report.steps, report.losses))


def asked(path, *stops, **more):
    return SnakeRequest(DUEL, stops=stops, run=path, overrides=SMALL, algorithm="alphazero", **more)


def test_a_run_of_ppo_goes_on_by_search_is_resumed_bit_by_bit_and_plays(tmp_path):
    tiny = (*NETWORK, "rollout.num_worlds=16", "rollout.horizon=8", "evaluation.episodes=2", "runtime.threads=1")
    train(SnakeRequest(DUEL, stops=("iterations=1",), run=tmp_path / "ppo", overrides=tiny), Quiet(), lambda _: None)
    begun = {"clone_from": str(tmp_path / "ppo")}
    whole, first, second = Quiet(), Quiet(), Quiet()
    train(asked(tmp_path / "whole", "iterations=3", **begun), whole, lambda _: None)
    train(asked(tmp_path / "broken", "iterations=2", **begun), first, lambda _: None)
    resume(tmp_path / "broken", ("iterations=3",), second, lambda _: None, "battlesnake")
    assert [steps for steps, _ in whole.told][-1] == [steps for steps, _ in second.told][-1]
    assert whole.told[2] == second.told[0], "the third iteration is the same, bit by bit"
    job = RunFolder.open(tmp_path / "whole").read_job_of("battlesnake")
    assert job["algorithm"] == "alphazero"
    assert job["settings"]["search"]["walks"] == 6
    board = Board(7, 7, 3, [Snake("a", [(3, 3), (3, 2), (3, 1)]), Snake("b", [(5, 5), (5, 6), (4, 6)])], [(0, 0)])
    for name in ("whole", "ppo"):
        for way in ("", "search+", "search:"):
            assert find_player(f"{way}{tmp_path / name}").choose(board, DUEL, "a", 0.05) in MOVES


def test_a_policy_without_a_critic_cannot_be_asked_about_leaves(tmp_path):
    tiny = (*NETWORK, "rollout.num_worlds=4", "rollout.horizon=8", "evaluation.episodes=2", "runtime.threads=1")
    request = SnakeRequest(DUEL, stops=("iterations=1",), run=tmp_path / "dqn", overrides=tiny, algorithm="dqn")
    train(request, Quiet(), lambda _: None)
    with pytest.raises(PlayerError, match="dqn has no critic"):
        find_player(f"search:{tmp_path / 'dqn'}")


def test_a_setting_of_the_search_has_no_say_in_a_training_without_one(tmp_path):
    with pytest.raises(SettingError, match="search"):
        train(
            SnakeRequest(DUEL, stops=("iterations=1",), run=tmp_path / "r", overrides=("search.walks=6",)),
            Quiet(),
            print,
        )
