"""Training against others: whose cars are learned from, who drives the others, and what the run remembers of it."""

import numpy as np
import pytest

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.contract.world import allocate
from racecraft.formats.checkpoint import Checkpoints
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionTable
from racecraft.worlds.deepracer.env.camera import MOUNT_V3
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME
from racecraft.worlds.deepracer.env.sensors import FRONT_CAMERA
from racecraft.worlds.deepracer.env.settings import AgainstConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.players.driver import Driver, league_in, load_driver
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.opponent_world import OpponentWorld, deal, own_actions
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car

TABLE = ActionTable.of([(-0.5, 0.5), (0.0, 1.5), (0.5, 0.5)])
SMALL = (
    "rollout.num_worlds=4", "rollout.horizon=16", "network.hidden_units=8",
    "evaluation.episodes=2", "race.max_episode_seconds=2", "runtime.threads=1",
)  # fmt: skip


class Always:
    """Chooses one action, and notes for how many cars it was asked."""

    def __init__(self, action):
        self.action, self.asked, self.forgotten = action, [], 0

    def begin(self, seed):
        self.seed = seed

    def act(self, observations, action_mask=None):
        self.asked.append(len(observations[CAMERA_NAME]))
        return np.repeat(np.array([self.action]), self.asked[-1], axis=0)

    def reset_state(self, rows):
        self.forgotten += int(rows.sum())


def driver(name, policy, actions=TABLE):
    return Driver(name, policy, actions, "v6", CameraConfig(16, 12), MOUNT_V3, FRONT_CAMERA)


def make_world(races, config, chosen=(), itself=True, reward=None, past=None):
    dealt = deal(races, config, len(chosen), itself)
    inner = RaceWorld(
        load_track("reinvent_base"), own_actions(TABLE, chosen, dealt), reward,
        race_config=RaceConfig(type="HEAD_TO_MODEL", max_episode_seconds=1.5), camera_config=CameraConfig(16, 12),
        num_cars=races, cars_per_world=config.cars, start_ahead=config.start_ahead,
    )  # fmt: skip
    world = OpponentWorld(inner, driver("learner", None), dealt, chosen)
    world.meet(past or Always(1))
    return world


class TestAgainst(WorldConformance):
    """Races against a chosen model, a past self and itself, as the learner sees them, sit the exam."""

    ticks = 60
    worlds_may_differ = False

    def make_world(self, num_worlds):
        config = AgainstConfig(cars=2, chosen_share=0.0, pool_share=1.0)
        return make_world(num_worlds, config, reward=lambda params: params["progress"])


def test_only_the_learners_cars_are_rows():
    """Of 4 races of 3 cars: 2 against chosen models, 1 against the past, 1 against itself: 1 + 1 + 1 + 3 rows."""
    left, right, past = Always(2), Always([0.1, 1.0]), Always(0)
    chosen = (driver("left", left), driver("right", right, ActionBox((-0.5, 0.5), (0.1, 3.0))))
    world = make_world(4, AgainstConfig(cars=3), chosen, past=past)
    assert world.dealt.kinds == ("chosen", "chosen", "past", "self")
    assert world.spec.num_worlds == 6
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    for _ in range(3):
        world.step(np.ones((6, 1), int), buffers)
    numbers = world.inner.reports["action"]
    assert numbers.tolist() == [[1, 2, -1], [2, 1, -1], [0, 0, 1], [1, 1, 1]]
    assert world.inner.reports["steering"][0, 2] == pytest.approx(0.1)
    assert left.asked == right.asked == past.asked == [2, 2, 2]
    assert (world.reports["action"] == 1).all()
    assert np.array_equal(
        buffers.observations[CAMERA_NAME][:, 0], world._buffers.observations[CAMERA_NAME][world.dealt.mine]
    )


def test_past_selves_drive_slower_cars_in_some_races_and_nobody_else_does():
    """Of 4 races all are against the past: at 0.4, 0.6, 0.8 and 1.0 of the speed that is told."""
    world = make_world(4, AgainstConfig(pool_share=1.0, slowest=0.4), past=Always(1))
    world.meet(Always(1))  # another past self gets in: cars are as slow as before
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    for _ in range(12):
        world.step(np.ones((4, 1), int), buffers)
    driven, others = world.inner.reports["driven_speed"], ~world.dealt.mine
    assert (world.inner.reports["speed"] == 1.5).all()
    own = driven[world.dealt.mine]
    np.testing.assert_allclose(driven[others] / own, [0.4, 0.6, 0.8, 1.0], rtol=1e-6)
    assert np.ptp(own) < 1e-9


def test_episodes_of_the_learner_alone_are_told_by_row():
    world = make_world(4, AgainstConfig(cars=3), (driver("left", Always(2)),))
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    told = []
    for _ in range(40):
        world.step(np.ones((6, 1), int), buffers)
        told += world.pop_episodes()
    assert {one.world for one in told} == set(range(6))
    assert {one.agent for one in told} == {0}


def test_who_is_forgotten_is_whose_episode_ended():
    left = Always(2)
    world = make_world(2, AgainstConfig(), (driver("left", left),), itself=False)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    before, ended = left.forgotten, 0
    for _ in range(40):
        world.step(np.ones((2, 1), int), buffers)
        ended += int(world._buffers.ended[world.dealt.whose == 2].sum())
    assert left.forgotten - before == ended > 0


def trained(tmp_path, name, *overrides, **words):
    request = RaceRequest(run=tmp_path / name, stops=("iterations=2",), overrides=(*SMALL, *overrides), **words)
    return train(request, NullCallback(), lambda text: None)


def test_a_car_is_trained_against_its_past_and_a_run_goes_on_with_it(tmp_path):
    done = trained(tmp_path, "a", "against.pool_every=1", against=("self",))
    job = done.run.read_job()
    assert job["asked"]["against"] == ["self"]
    assert job["settings"]["race"]["type"] == "HEAD_TO_MODEL"
    kept = Checkpoints(done.run.checkpoints).load_state("last")["parts"]["opponents"]
    assert int(kept["updates"]) == 2
    assert len(kept["selves"]) == 3
    first = Checkpoints(done.run.checkpoints).load_policy("0")[0]
    for name, weights in first.items():
        assert np.array_equal(kept["selves"][0][name], weights), "the pool begins with the untrained self"
    resume(done.run.path, ("iterations=3",), NullCallback(), lambda text: None, "deepracer")
    kept = Checkpoints(done.run.checkpoints).load_state("last")["parts"]["opponents"]
    assert int(kept["updates"]) == 3
    assert len(kept["selves"]) == 4


def test_a_car_is_trained_against_a_chosen_run_and_a_league(tmp_path):
    rival = trained(tmp_path, "league/a").run.path
    trained(tmp_path, "league/b")
    one = trained(tmp_path, "one", against=(f"{rival}:0",))
    assert "opponents" not in Checkpoints(one.run.checkpoints).load_state("last")["parts"]
    assert league_in([str(tmp_path / "league"), "self"]) == [str(rival), str(tmp_path / "league" / "b"), "self"]
    both = trained(tmp_path, "both", against=("self", str(tmp_path / "league")))
    assert both.run.read_job()["asked"]["against"] == ["self", str(tmp_path / "league")]
    assert load_driver(str(rival)).name == "a"


def test_whole_episodes_are_driven_against_others_too(tmp_path):
    """By rows: two races of itself have two learners' cars each, two of its past have one."""
    done = trained(tmp_path, "a", "rollout.episodes_per_iteration=4", against=("self",), algorithm="reinforce")
    told = done.run.read_metrics()
    assert [row["episodes"] for row in told] == [6, 6]


def test_head_to_model_in_run_env_races_itself(tmp_path):
    (tmp_path / "run.env").write_text("DR_RACE_TYPE=HEAD_TO_MODEL\n")
    planned = plan_car(RaceRequest(folder=tmp_path))
    assert planned.against == ("self",)
    assert planned.settings.race.type == "HEAD_TO_MODEL"
    assert plan_car(RaceRequest()).against == ()


@pytest.mark.parametrize(
    ("words", "error", "said"),
    [
        ({"against": ("nowhere",)}, RunFolderError, "nowhere"),
        ({"against": ("self",), "overrides": ("race.type=HEAD_TO_BOT",)}, SettingError, "--against asks for a race"),
        ({"against": ("self",), "overrides": ("against.cars=9",)}, SettingError, "against.cars is 9; expected 2 to 8"),
    ],
)
def test_what_cannot_be_raced_is_named_before_a_folder_is_made(tmp_path, words, error, said):
    asked = {"run": tmp_path / "run", "stops": ("iterations=1",), **words}
    asked["overrides"] = (*SMALL, *asked.get("overrides", ()))
    with pytest.raises(error, match=said):
        train(RaceRequest(**asked), NullCallback(), lambda text: None)
    assert not (tmp_path / "run").exists()
