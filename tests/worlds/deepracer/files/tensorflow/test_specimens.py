"""What real TensorFlow wrote, read in a plain clone: numbers that TensorFlow itself gave."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.worlds.deepracer.files.tensorflow.policies import METADATA, RANGES

from racecraft.players.trained import load_policy
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME
from racecraft.worlds.deepracer.files.policy_graph import input_name, policy_output_in
from racecraft.worlds.deepracer.files.tensorflow.arithmetic import GraphFunction
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import read_checkpoint
from racecraft.worlds.deepracer.files.tensorflow.graph import read_graph, read_meta_graph
from racecraft.worlds.deepracer.players.aws_model import import_model

SPECIMENS = Path(__file__).with_name("specimens")


def frames():
    """Coarse frames, uint8 (3, 120, 160), as those that TensorFlow was shown."""
    return np.kron(np.random.default_rng(5).integers(0, 256, (3, 6, 8)), np.ones((1, 20, 20))).astype(np.uint8)


def asked(function, kind):
    return function({input_name(kind, CAMERA_NAME): frames()[..., None]})


@pytest.mark.parametrize("kind", ["discrete", "sac"])
def test_a_frozen_graph_computes_what_tensorflow_computed(kind):
    graph = read_graph(SPECIMENS / kind / "model_3.pb")
    told = asked(GraphFunction(graph, policy_output_in(graph, "model_3.pb")), kind)
    np.testing.assert_allclose(told, np.load(SPECIMENS / kind / "answers.npy"), atol=1e-5)


def test_a_checkpoint_and_its_meta_graph_compute_it_too():
    prefix = SPECIMENS / "discrete" / "3_Step-700.ckpt"
    graph = read_meta_graph(f"{prefix}.meta")
    function = GraphFunction(graph, policy_output_in(graph, prefix), read_checkpoint(prefix))
    np.testing.assert_allclose(asked(function, "discrete"), np.load(SPECIMENS / "discrete" / "answers.npy"), atol=1e-6)


@pytest.mark.parametrize("lone_graph", [False, True])
def test_a_model_becomes_a_run_that_answers_as_tensorflow_did(tmp_path, lone_graph):
    folder = tmp_path / "model"
    shutil.copytree(SPECIMENS / "discrete", folder)
    METADATA["discrete"](folder / "model_metadata.json")

    done = import_model(folder / "model_3.pb" if lone_graph else folder, tmp_path / "run")

    told = load_policy(done.run).probabilities({CAMERA_NAME: frames()})
    np.testing.assert_allclose(told, np.load(SPECIMENS / "discrete" / "answers.npy"), atol=1e-6)
    assert any("critic begins anew" in note for note in done.notes) == lone_graph


def test_a_lone_graph_of_sac_drives_by_its_mean(tmp_path):
    METADATA["sac"](tmp_path / "model_metadata.json")
    shutil.copy(SPECIMENS / "sac" / "model_3.pb", tmp_path / "agent.pb")

    policy = load_policy(tmp_path / "agent.pb")

    units = np.tanh(np.load(SPECIMENS / "sac" / "answers.npy"))
    low, high = np.float32(RANGES.low), np.float32(RANGES.high)
    np.testing.assert_allclose(policy.act({CAMERA_NAME: frames()}), low + (units + 1) / 2 * (high - low), atol=1e-5)
