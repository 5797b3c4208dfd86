"""Snakes that learn: seats, pool, judge, a run folder that resumes, a policy that plays from files alone."""

import json
from pathlib import Path

import numpy as np
import pytest

from racecraft.algorithms.ppo import PpoLearner
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.weights import to_arrays
from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import RunFolderError
from racecraft.contract.world import allocate
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.settings.overrides import with_values
from racecraft.training.callbacks import IterationReport
from racecraft.training.opponent_pool import OpponentPool
from racecraft.training.worlds import resume, train
from racecraft.worlds.battlesnake.env.board import MOVES
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import WorldSettings
from racecraft.worlds.battlesnake.evaluation.batch import play_batch
from racecraft.worlds.battlesnake.players.find import find_player
from racecraft.worlds.battlesnake.players.protocol import BatchPlayer, MovePrior, MoveRequest
from racecraft.worlds.battlesnake.players.safe_moves import safe_moves
from racecraft.worlds.battlesnake.players.search import Search
from racecraft.worlds.battlesnake.players.trained import load_trained_snake
from racecraft.worlds.battlesnake.training.evaluator import count, rating_among
from racecraft.worlds.battlesnake.training.self_play import ANCHOR, PAST, SELF, SelfPlayWorld, deal, world_settings
from racecraft.worlds.battlesnake.training.settings import SelfPlayConfig
from racecraft.worlds.battlesnake.training.trainer import SnakeRequest, default_settings

DUEL = GameSettings(7, 7, 2)
TINY = (
    "rollout.num_worlds=16", "rollout.horizon=16", "network.image_units=16", "network.hidden_units=32",
    "ppo.batch_size=128", "evaluation.every=2", "evaluation.share=none", "evaluation.episodes=6",
    "selfplay.pool_every=1", "selfplay.pool_size=2", "snake.max_turns=60", "runtime.threads=1",
)  # fmt: skip


class Quiet:
    """A listener that keeps the reports."""

    def __init__(self):
        self.reports: list[IterationReport] = []

    def begin(self, title, stops, score_name):
        self.title, self.stops, self.score_name = title, stops, score_name

    def iteration(self, report):
        self.reports.append(report)

    def end(self, reason):
        self.reason = reason


def tiny(path, *stops, **more):
    return SnakeRequest(DUEL, stops=stops or ("iterations=4",), run=Path(path), overrides=TINY, **more)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run of four small iterations."""
    path = tmp_path_factory.mktemp("snakes") / "run"
    listener = Quiet()
    train(tiny(path), listener, lambda _: None)
    return path, listener


def eaten_and_paid(**config):
    """Return, over a few hundred turns of safe moves, what snakes were paid that only ate or did nothing at all."""
    world, _ = small_world(seats=2, **config)
    buffers, rng = allocate(world.spec), np.random.default_rng(0)
    world.reset(buffers, 4)
    paid = set()
    for _ in range(150):
        liking = rng.random(buffers.action_mask[:, 0].shape) * buffers.action_mask[:, 0]
        world.step(liking.argmax(axis=-1)[:, None], buffers)
        paid |= {float(reward) for reward in buffers.reward[~buffers.ended]}
    foods = sum(one.facts["food_eaten"] for one in world.pop_episodes())
    world.close()
    return foods, paid


@pytest.mark.parametrize("prize", [0.0, 0.25, -0.5])
def test_a_food_is_paid_as_the_setting_says(prize):
    foods, paid = eaten_and_paid(food_prize=prize)
    assert foods > 10
    assert paid == {0.0, prize}


SNAKE = ("view", "outlook", "food_prize", "max_turns")


def small_world(seats=3, **config):
    settings = with_values(default_settings(find_algorithm("ppo")), "rollout", {"num_worlds": 8})
    settings = with_values(settings, "network", {"image_units": (8,), "hidden_units": (8,)})
    settings = with_values(settings, "snake", {"view": 5, **{key: config.pop(key) for key in SNAKE if key in config}})
    settings = with_values(settings, "selfplay", {"pool_size": 2, "pool_every": 2, **config})
    played = world_settings(WorldSettings(GameSettings(7, 7, seats)), settings.snake, 8)
    world = SelfPlayWorld(played, settings.selfplay)
    world.meet(pool_of(world, settings))
    return world, settings


def pool_of(world, settings, seed=1):
    learner = PpoLearner(world.spec, settings.network, settings.ppo, seed)
    config = settings.selfplay
    first = to_arrays(learner.state_dict())["network"]
    return OpponentPool(learner.policy_spec, first, config.pool_size, config.pool_every, seed)


class TestSelfPlaySitsTheExam(WorldConformance):
    ticks = 60

    def make_world(self, num_worlds):
        world, _ = small_world(anchor_share=0.5, pool_share=0.25, max_turns=30)
        world.meet(FirstAllowed())  # the pool keeps its dice itself; the world's own story must not hang on them
        return world


class FirstAllowed:
    """Takes the first move that is allowed."""

    def begin(self, seed): ...

    def reset_state(self, rows): ...

    def act(self, observations, action_mask=None):
        return action_mask.argmax(axis=1)


def test_games_are_dealt_by_shares():
    assert deal(8, SelfPlayConfig(anchor_share=0.25, pool_share=0.5)) == [ANCHOR] * 2 + [PAST] * 4 + [SELF] * 2
    assert deal(4, SelfPlayConfig(anchor_share=1.0, pool_share=1.0)) == [ANCHOR] * 4


def test_only_the_learners_own_seats_are_rows_and_only_they_obey():
    world, _ = small_world(anchor_share=0.5, pool_share=0.25)
    assert world.spec.num_worlds == 4 + 2 + 2 * 3, "one seat against others, all three against itself"
    buffers = allocate(world.spec)
    world.reset(buffers, 2)
    seen = world._buffers.observations["numbers"]
    assert np.array_equal(buffers.observations["numbers"][:, 0], np.concatenate([seen[:6, 0], seen[6:].reshape(6, 6)]))
    asked = np.tile(np.arange(4), 3)[:, None]
    world.step(asked, buffers)
    obeyed = np.concatenate([world._moves[:6, 0], world._moves[6:].reshape(-1)])
    assert np.array_equal(obeyed, asked[:, 0])


def test_what_opponents_do_is_never_learned_from():
    world, settings = small_world(seats=2, anchor_share=1.0)
    learner = PpoLearner(world.spec, settings.network, settings.ppo, seed=1)
    kept = Collector(world, learner, 32, seed=1).collect()
    assert kept.reward.shape == (32, 8), "one row a game although two snakes play"
    assert kept.active.all(), "in a duel the learner lives as long as the game"
    crowd, settings = small_world(seats=3, anchor_share=1.0)
    learner = PpoLearner(crowd.spec, settings.network, settings.ppo, seed=1)
    kept = Collector(crowd, learner, 64, seed=1).collect()
    dead = ~kept.active
    assert dead.any()
    assert (kept.reward[dead] == 0).all(), "dead, it waits for the others' end and is not taught by it"


def test_the_pool_takes_in_selves_and_lets_the_oldest_go():
    world, settings = small_world(pool_share=0.5)
    learner = PpoLearner(world.spec, settings.network, settings.ppo, seed=1)
    pool = pool_of(world, settings)
    first = pool.selves[0]["policy_head.weight"].copy()
    assert np.array_equal(first, learner.state_dict()["network"]["policy_head.weight"]), "it begins with the untrained"
    for update in range(1, 5):
        learner.network.policy_head.weight.data.fill_(float(update))
        pool.learned(learner)
    assert [float(weights["policy_head.weight"].flat[0]) for weights in pool.selves] == [2.0, 4.0]
    playing = float(pool._opponent.network.policy_head.weight.data.flatten()[0])
    assert playing in (2.0, 4.0), "the past self is one of the pool"


def test_a_past_self_is_asked_for_its_own_seats_only():
    world, _ = small_world(seats=2, anchor_share=0.0, pool_share=0.5)
    asked = []

    class Up:
        def begin(self, seed): ...
        def reset_state(self, rows): ...
        def act(self, observations, action_mask=None):
            asked.append(len(action_mask))
            return np.zeros(len(action_mask), np.int64)

    world.meet(Up())
    buffers = allocate(world.spec)
    world.reset(buffers, 3)
    world.step(np.zeros((world.spec.num_worlds, 1), np.int64), buffers)
    assert asked == [4], "of eight duels four are against a past self, one seat each"


def test_self_play_goes_on_from_a_saved_state_bit_by_bit():
    world, settings = small_world(anchor_share=0.5, pool_share=0.25)
    learner, pool = PpoLearner(world.spec, settings.network, settings.ppo, seed=3), pool_of(world, settings)
    world.meet(pool)
    buffers = allocate(world.spec)
    world.reset(buffers, 5)
    for _ in range(3):
        pool.learned(learner)
        world.step(np.zeros((12, 1), np.int64), buffers)
    state = world.save_state(), pool.state()
    told = []
    for _ in range(2):
        world.load_state(state[0], buffers)
        pool.restore(state[1])
        for turn in range(10):
            world.step(np.full((12, 1), turn % 4), buffers)
        told.append({name: array.copy() for name, array in buffers.observations.items()})
    assert all(np.array_equal(told[0][name], told[1][name]) for name in told[0])


def test_batch_games_are_fair_and_end_as_they_should():
    wide = WorldSettings(DUEL, view=5)
    strong = play_batch(["flood_fill", "random_safe"], wide, 40, seed=1)
    tally = count(strong)
    assert tally.games == 40
    assert tally.won > 30
    swapped = count(play_batch(["random_safe", "flood_fill"], wide, 40, seed=1))
    assert swapped.lost > 30
    cut = play_batch(["flood_fill", "flood_fill"], wide, 4, seed=1, most_turns=2)
    assert all(result.places == (0, 0) for result in cut), "cut short, all who live share the first place"
    crowd = play_batch(["flood_fill", "hungry", "random_safe", "random_safe"], WorldSettings(GameSettings()), 8, seed=1)
    assert all(sorted(result.places)[0] == 0 and len(result.places) == 4 for result in crowd)


def test_a_rating_stands_on_the_anchors_mean():
    from racecraft.evaluation.rating import Result

    level = [Result((one, two), (turn, 1 - turn)) for one in range(4) for two in range(one) for turn in (0, 1)] * 20
    assert rating_among(level).points == pytest.approx(1500, abs=1)
    better = level + [Result((3, one), (0, 1)) for one in range(3)] * 20
    assert rating_among(better).points > 1550


def test_a_tiny_game_is_learned_in_seconds():
    """From 50 % against the weakest anchor to far beyond, on a small board in a few thousand turns."""
    settings = with_values(default_settings(find_algorithm("ppo")), "rollout", {"num_worlds": 64, "horizon": 32})
    settings = with_values(settings, "network", NETWORK_OF_THE_TINY)
    settings = with_values(settings, "ppo", {"batch_size": 256, "learning_rate": 2e-3, "discount": 0.98})
    settings = with_values(settings, "selfplay", {"anchor_share": 1.0, "anchors": ("random_safe",)})
    played = world_settings(WorldSettings(DUEL), with_values(settings, "snake", {"view": 5}).snake, 64)
    world = SelfPlayWorld(played, settings.selfplay)
    learner = PpoLearner(world.spec, settings.network, settings.ppo, seed=1)
    judged = lambda: count(play_batch([GreedyPolicy(learner), "random_safe"], played, 100, seed=7)).won  # noqa: E731
    before = judged()
    collector = Collector(world, learner, 32, seed=1)
    for _ in range(15):
        learner.update(collector.collect())
    assert before < 70
    assert judged() > 80


NETWORK_OF_THE_TINY = {"image_units": (16,), "hidden_units": (32,)}


def test_a_run_folder_holds_ratings_and_a_policy(run):
    path, listener = run
    assert listener.score_name == "rating"
    assert [report.result is not None for report in listener.reports] == [False, True, False, True]
    judged = json.loads((path / "evaluations" / "4.json").read_text())
    assert judged["rating_low"] < judged["rating"] < judged["rating_high"]
    assert set(judged["against"]) == {"random_safe", "hungry", "flood_fill"}
    assert judged["against"]["hungry"]["games"] == 6
    last = json.loads((path / "metrics.jsonl").read_text().splitlines()[-1])
    assert last["evaluation_score"] == judged["rating"]
    assert last["training_score"] is None


def test_a_resumed_run_takes_the_same_way(run, tmp_path):
    path, listener = run
    again, rest = Quiet(), Quiet()
    train(tiny(tmp_path / "broken", "iterations=2"), again, lambda _: None)
    resume(tmp_path / "broken", ("iterations=4",), rest, lambda _: None)
    whole = [(report.losses, report.result and report.result.score) for report in listener.reports]
    parts = [(report.losses, report.result and report.result.score) for report in again.reports + rest.reports]
    assert parts == whole


def test_a_stop_at_a_rating_holds(tmp_path):
    listener = Quiet()
    train(tiny(tmp_path / "run", "rating=100", "iterations=9"), listener, lambda _: None)
    assert listener.reason == "rating=100"
    assert len(listener.reports) == 2


def test_a_trained_snake_plays_from_files_alone(run):
    path, _ = run
    player = find_player(str(path))
    assert isinstance(player, BatchPlayer)
    assert isinstance(player, MovePrior)
    for settings in (DUEL, GameSettings(11, 9, 4, "wrapped"), GameSettings(7, 7, 1, "solo")):
        referee = Referee(settings, StreamDice(1))
        for _ in range(8):
            living = referee.board.alive()
            asked = [MoveRequest(referee.board, snake.id, settings) for snake in living]
            one_by_one = [player.choose(*question[:1], settings, question.snake_id, 0.1) for question in asked]
            assert player.choose_many(asked) == one_by_one
            for snake, move in zip(living, one_by_one, strict=True):
                assert move in (safe_moves(referee.board, settings, snake.id) or MOVES)
            chances = player.chances(asked)
            assert chances.shape == (len(living), 4)
            assert np.allclose(chances.sum(axis=1), 1.0, atol=1e-5)
            weighed = player.move_priors(referee.board, settings)
            assert np.array_equal(weighed, chances) if len(living) <= DUEL.players else weighed is None
            referee.turn(dict(zip([snake.id for snake in living], one_by_one, strict=True)))
            if referee.over:
                break


def test_search_on_top_of_a_policy_moves_legally_and_believes_it(run):
    path, _ = run
    player = find_player(f"search+{path}:last")
    assert isinstance(player, Search)
    assert isinstance(player.guide, MovePrior)
    player.most_walks = 64
    referee = Referee(GameSettings(7, 7, 3), StreamDice(2))
    while not referee.over and referee.board.turn < 10:
        moves = {}
        for snake in referee.board.alive():
            moves[snake.id] = player.choose(referee.board, referee.settings, snake.id, 5.0)
            assert moves[snake.id] in (safe_moves(referee.board, referee.settings, snake.id) or MOVES)
        referee.turn(moves)


def test_a_checkpoint_is_chosen_by_name(run):
    path, _ = run
    assert load_trained_snake(f"{path}:0").name == f"{path}:0"
    assert load_trained_snake(f"{path}:0").most_snakes == tiny(path).game.players
    with pytest.raises(Exception, match="no checkpoint '99'.*: 0 to 4"):
        find_player(f"{path}:99")


def test_runs_of_other_things_are_refused(tmp_path):
    RunFolder.create(tmp_path / "car", {"kind": "deepracer"})
    with pytest.raises(RunFolderError, match="one of `racecraft train`; expected one of `racecraft snakes train`"):
        find_player(str(tmp_path / "car"))
    (tmp_path / "empty").mkdir()
    with pytest.raises(Exception, match="empty"):
        find_player(str(tmp_path / "empty"))
