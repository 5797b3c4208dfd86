"""By learning: small scenes with pictures, pictures beside numbers, masks and hybrid actions, as a user trains them.

Each scene is a program of its own at the other end of a real wire. Each is learnt to a return that random play is far
from, and its ONNX file then acts as the checkpoint does on what the policy saw.
"""

import stat
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from racecraft.algorithms.ppo import PpoLearner
from racecraft.contract.errors import SettingError
from racecraft.contract.world import DiscreteActions, HybridActions
from racecraft.formats.checkpoint import Checkpoints
from racecraft.rollout.episodes import play_episodes
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.unity.env.errors import PlayerDiedError
from racecraft.worlds.unity.env.world import UnityWorld
from racecraft.worlds.unity.export.unity_run import export_to_unity
from racecraft.worlds.unity.training.plan import UnityRequest

pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")

SCENES = Path(__file__).resolve().parents[3] / "worlds" / "unity" / "env"
OFTEN = ("evaluation.every=2", "evaluation.episodes=16", "rollout.horizon=32", "ppo.batch_size=128")
SMALL_EYE = ("network.conv_filters=8", "network.conv_kernels=4", "network.conv_strides=4", "ppo.learning_rate=3e-3")
PROGRAM = """#!{python}
import sys
import threading
sys.path[:0] = [{home!r}, {scenes!r}]
sys.argv += ["--scene", {scene!r}]
from scenes import main
sys.exit(main())
"""


@pytest.fixture
def player(tmp_path):
    """Return a player's file for one of the scenes, as a user has one."""

    def write(scene):
        import racecraft

        file = tmp_path / f"{scene}.x86_64"
        home = str(Path(racecraft.__file__).parent.parent)
        file.write_text(PROGRAM.format(python=sys.executable, home=home, scenes=str(SCENES), scene=scene))
        file.chmod(file.stat().st_mode | stat.S_IXUSR)
        return str(file)

    return write


def counts_of(actions):
    if isinstance(actions, DiscreteActions):
        return [actions.count]
    return (actions.discrete if isinstance(actions, HybridActions) else actions).counts


class Chance:
    """Any allowed choice, any number."""

    def __init__(self, actions):
        self.actions, self.rng = actions, np.random.default_rng(0)

    def act(self, observations, action_mask=None):
        rows = len(next(iter(observations.values())))
        parts = [] if action_mask is None else np.split(action_mask, np.cumsum(counts_of(self.actions))[:-1], axis=1)
        chosen = [[self.rng.choice(np.flatnonzero(allowed)) for allowed in part] for part in parts]
        if isinstance(self.actions, DiscreteActions):
            return np.array(chosen[0])
        numbers = [self.rng.uniform(-1, 1, rows)] if isinstance(self.actions, HybridActions) else []
        return np.stack([*numbers, *chosen], axis=1).astype(self.actions.dtype)

    def reset_state(self, rows):
        pass


def mean_return_of_chance(build):
    world = UnityWorld(build)
    played = play_episodes(Chance(world.spec.actions), world, episodes_each=8, max_ticks=100)
    world.close()
    return np.mean([episode.reward for episode in played])


RARER = {"dot-png": 0.9, "tell": 0.8, "doors": 0.9, "dot-raw": 0.9, "dot-sign-raw": 0.9, "dot-sign-png": 0.9}
"""Long: pictures and told numbers are learnt side by side below, and `levers` has masks and hybrid actions."""


@pytest.mark.parametrize(
    ("scene", "wanted"),
    [("levers", 0.9), *(pytest.param(scene, wanted, marks=pytest.mark.long) for scene, wanted in RARER.items())],
)
def test_a_scene_is_learnt_that_chance_does_not_solve(player, tmp_path, scene, wanted):
    build = player(scene)
    assert mean_return_of_chance(build) < wanted - 0.6
    settings = (*OFTEN, *(SMALL_EYE if scene.startswith("dot") else ()))
    request = UnityRequest(build, stops=(f"score={wanted}", "iterations=40"), run=tmp_path / "run", overrides=settings)
    trained = train(request, NullCallback(), str)
    assert trained.outcome.last.details["mean_return"] >= wanted
    assert trained.outcome.reason == f"score={wanted}"
    pytest.importorskip("onnxruntime", reason="the extra racecraft[onnx] is not installed")
    (exported,) = export_to_unity(tmp_path / "run")
    assert exported.recorded
    assert exported.checked_on >= 16
    assert exported.largest_difference < 1e-5


SAC = """
behaviors:
  Aim:
    trainer_type: sac
    hyperparameters: {batch_size: 64, buffer_size: 20000, learning_rate: 3e-3, steps_per_update: 4, init_entcoef: 0.1}
    network_settings: {hidden_units: 32, num_layers: 2, normalize: true}
    reward_signals: {extrinsic: {gamma: 0.9, strength: 1.0}}
    max_steps: 40000
"""


def test_a_file_that_asks_for_sac_is_learnt_by_sac_and_goes_on(player, tmp_path):
    pytest.importorskip("yaml", reason="pyyaml is not installed")
    (tmp_path / "aim.yaml").write_text(SAC)
    request = UnityRequest(
        player("aim"), config=tmp_path / "aim.yaml", stops=("score=0.8",), run=tmp_path / "run",
        overrides=("evaluation.every=4", "evaluation.episodes=16"),
    )  # fmt: skip
    trained = train(request, NullCallback(), str)
    job = trained.run.read_job()
    assert (job["algorithm"], trained.outcome.reason) == ("sac", "score=0.8")
    assert (job["settings"]["sac"]["gradient_steps_per_step"], job["settings"]["replay"]["capacity"]) == (0.25, 20_000)
    assert any("sac reads vectors as they are" in note for note in trained.summary()["notes"])
    further = resume(tmp_path / "run", ("iterations=2",), NullCallback(), str)
    assert further.run.read_job()["algorithm"] == "sac"
    pytest.importorskip("onnxruntime", reason="the extra racecraft[onnx] is not installed")
    (exported,) = export_to_unity(tmp_path / "run")
    assert exported.recorded
    assert exported.checked_on >= 16
    assert exported.largest_difference < 1e-5


def test_two_behaviors_learn_side_by_side_and_both_go_back_into_unity(player, tmp_path):
    """One sees pictures and asks at every second message, the other tells numbers and bits."""
    more = ("evaluation.every=4", "rollout.horizon=48", *SMALL_EYE[:3])
    request = UnityRequest(
        player("duo"), stops=("score=0.8", "iterations=60"), run=tmp_path / "run", overrides=(*OFTEN, *more)
    )
    said = []
    trained = train(request, NullCallback(), said.append)
    assert said == ["- Dot, Teller learn side by side, each from its own agents; --behavior chooses one"]
    told = trained.outcome.last.details["behaviors"]
    assert trained.outcome.reason == "score=0.8"
    assert min(part["mean_return"] for part in told.values()) > 0.6
    pytest.importorskip("onnxruntime", reason="the extra racecraft[onnx] is not installed")
    exported = export_to_unity(tmp_path / "run")
    assert [file.path.name for file in exported] == ["Dot.onnx", "Teller.onnx"]
    assert all(file.recorded and file.largest_difference < 1e-5 for file in exported)
    before = trained.outcome.steps
    with pytest.raises(SettingError, match="one file cannot hold Dot, Teller"):
        export_to_unity(tmp_path / "run", output=tmp_path / "x.onnx")
    again = resume(tmp_path / "run", (f"iterations={trained.outcome.iterations + 1}",), NullCallback(), str)
    assert again.outcome.steps == before + 48 * 20


def test_a_configuration_says_who_learns_and_how_each_does(player, tmp_path):
    pytest.importorskip("yaml", reason="pyyaml is not installed")
    (tmp_path / "two.yaml").write_text(
        "behaviors:\n"
        "  Dot: {hyperparameters: {learning_rate: 0.002, buffer_size: 80}, max_steps: 300}\n"
        "  Teller: {network_settings: {hidden_units: 16, num_layers: 1}, max_steps: 340}\n"
    )
    request = UnityRequest(
        player("duo"), tmp_path / "two.yaml", run=tmp_path / "run", overrides=("evaluation.every=9",)
    )
    trained = train(request, NullCallback(), str)
    _, card = Checkpoints(trained.run.checkpoints).load_policy("last")
    dot, teller = card["behaviors"]["Dot"], card["behaviors"]["Teller"]
    assert (dot["ppo"]["learning_rate"], teller["ppo"]["learning_rate"]) == (0.002, 0.001)
    assert (dot["network"]["hidden_units"], teller["network"]["hidden_units"]) == ([64, 64], [16])
    assert trained.outcome.reason == "steps=640"
    assert any(
        "buffers of the behaviors differ; they are filled together, 64 ticks" in note
        for note in trained.summary()["notes"]
    )


def test_a_player_that_dies_leaves_what_was_learnt_and_the_way_on(player, tmp_path):
    """It crashes in its ninth step, is started anew, and crashes again too soon: four iterations of four are kept."""
    said, run = [], tmp_path / "run"
    request = UnityRequest(player("crash"), run=run, overrides=("rollout.horizon=4", "evaluation.every=9"))
    with pytest.raises(PlayerDiedError, match="out of neutrons"):
        train(request, NullCallback(), said.append)
    assert said[-1] == f"what was learned until then stands in {run}; --run {run} --resume goes on from there"
    with pytest.raises(PlayerDiedError):
        resume(run, (), NullCallback(), said.append)
    assert any(line.startswith("goes on after iteration 4;") for line in said)


def test_rows_for_agents_that_come_later_are_kept_when_asked_for(player, tmp_path):
    request = UnityRequest(
        player("tell"), run=tmp_path / "run", max_agents=20, stops=("iterations=1",), overrides=("rollout.horizon=4",)
    )
    trained = train(request, NullCallback(), str)
    job = trained.run.read_job()
    assert (job["settings"]["rollout"]["num_worlds"], job["asked"]["max_agents"]) == (20, 20)


BESIDE = ("ppo.asynchronous=true",)


def test_a_player_goes_on_while_it_is_learned_from(player, tmp_path, monkeypatch):
    """Every update but the last waits until the player has been told something more."""
    told, waited, step, update = threading.Event(), [], UnityWorld.step, PpoLearner.update

    def noted_step(self, actions, buffers):
        step(self, actions, buffers)
        told.set()

    def patient_update(self, experience):
        told.clear()
        waited.append(told.wait(60.0))
        return update(self, experience)

    monkeypatch.setattr(UnityWorld, "step", noted_step)
    monkeypatch.setattr(PpoLearner, "update", patient_update)
    few = ("rollout.horizon=8", "ppo.epochs=1", "evaluation.every=100", "evaluation.episodes=2")
    request = UnityRequest(player("tell"), run=tmp_path / "run", stops=("iterations=4",), overrides=(*few, *BESIDE))
    train(request, NullCallback(), str)
    assert len(waited) >= 3
    assert all(waited[:3])


def test_a_player_that_dies_while_it_is_learned_from_leaves_what_was_learnt(player, tmp_path):
    said, run = [], tmp_path / "run"
    request = UnityRequest(player("crash"), run=run, overrides=("rollout.horizon=4", "evaluation.every=9", *BESIDE))
    with pytest.raises(PlayerDiedError, match="out of neutrons"):
        train(request, NullCallback(), said.append)
    assert said[-1] == f"what was learned until then stands in {run}; --run {run} --resume goes on from there"
    with pytest.raises(PlayerDiedError):
        resume(run, (), NullCallback(), said.append)
    assert any(line.startswith("goes on after iteration 4;") for line in said)
