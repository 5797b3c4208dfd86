"""By learning: a policy learns in a Unity scene over the real wire, and its ONNX file plays as it does."""

import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import racecraft
from racecraft.algorithms.ppo import PpoLearner
from racecraft.contract.world import allocate
from racecraft.envs.unity.builds import Build
from racecraft.envs.unity.world import UnityWorld
from racecraft.evaluation.episodes import play_episodes
from racecraft.export.unity_model import check_unity_model, unity_model
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.settings.groups import NetworkConfig, PpoConfig

pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")

NETWORK = NetworkConfig(hidden_units=(32, 32), activation="tanh")
SCENES = Path(__file__).resolve().parents[1] / "envs" / "unity" / "scenes.py"


@pytest.fixture(autouse=True)
def _one_thread():
    """Networks this small only wait for each other's threads."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def learn(world, config, horizon, iterations, seed=1):
    learner = PpoLearner(world.spec, NETWORK, config, seed)
    collector = Collector(world, learner, horizon, seed)
    for _ in range(iterations):
        learner.update(collector.collect())
    return learner


class OnnxPlayer:
    """Plays from the exported file alone, as a scene would."""

    def __init__(self, model):
        onnxruntime = pytest.importorskip("onnxruntime", reason="the extra racecraft[onnx] is not installed")
        self.session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])

    def act(self, observations, action_mask=None):
        feeds = {"obs_0": observations["Basic"], "action_masks": action_mask.astype(np.float32)}
        return self.session.run(["deterministic_discrete_actions"], feeds)[0][:, 0]

    def forget(self, rows):
        pass


def test_basic_is_learnt_to_the_optimum_and_the_exported_file_plays_as_well():
    """32 agents, 15 updates; a mean of 0.92 over 20 greedy episodes, where 0.93 is the best there is."""
    pytest.importorskip("onnx", reason="the extra racecraft[onnx] is not installed")
    world = UnityWorld("builtin:Basic", args=["--agents", "32"], seed=1)
    learner = learn(world, PpoConfig(learning_rate=3e-3, discount=0.95, batch_size=256), horizon=32, iterations=15)
    judge = UnityWorld("builtin:Basic", args=["--agents", "20"])
    trained = play_episodes(GreedyPolicy(learner), judge)
    assert np.mean([episode.reward for episode in trained]) >= 0.92
    model = unity_model(learner.network, world.behavior)
    places = {"Basic": np.eye(20, dtype=np.float32)}
    assert check_unity_model(model, learner.network, world.behavior, places) == 0
    exported = play_episodes(OnnxPlayer(model), judge)
    assert [episode.reward for episode in exported] == [episode.reward for episode in trained]
    world.close()
    judge.close()


@pytest.mark.long
def test_numbers_and_choices_are_learnt_together():
    """Each agent tells a number and a bit that it sees: hybrid actions, by scores."""
    home = str(Path(racecraft.__file__).parent.parent)
    build = Build("copy", (sys.executable, "-P", str(SCENES), "--scene", "copy"), False, {"PYTHONPATH": home})
    world = UnityWorld(build, seed=1)
    config = PpoConfig(learning_rate=3e-3, discount=0.0, epochs=6, batch_size=256, entropy_weight=0.0)
    learner = learn(world, config, horizon=256, iterations=40)
    buffers = allocate(world.spec)
    world.reset(buffers, 2)
    earned = []
    for _ in range(50):
        world.step(learner.choose({"sight": buffers.observations["sight"][:, 0]})[:, None], buffers)
        earned.append(buffers.reward.mean())
    assert np.mean(earned) > 0.97
    world.close()
