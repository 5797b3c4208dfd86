"""TensorFlow itself is the judge: it reads what we write, and we read what it saved and froze.

Set RACECRAFT_TENSORFLOW_PYTHON to a Python that has it (`pip install tensorflow-cpu` in an environment of its own).
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.formats.tensorflow.policies import LISTED, METADATA, RANGES, layers_for

from racecraft.contract.world import ArraySpec
from racecraft.envs.deepracer.world import CAMERA_NAME
from racecraft.formats.aws.policy_graph import graph_of, output_name
from racecraft.formats.aws.policy_weights import arrays_of
from racecraft.formats.tensorflow.checkpoint import write_checkpoint
from racecraft.formats.tensorflow.graph import write_graph
from racecraft.players.deepracer.foreign_model import import_model
from racecraft.players.trained import load_policy

PYTHON = os.environ.get("RACECRAFT_TENSORFLOW_PYTHON", "")
SIDE = Path(__file__).with_name("tensorflow_side.py")

pytestmark = pytest.mark.skipif(
    not PYTHON, reason="needs TensorFlow: set RACECRAFT_TENSORFLOW_PYTHON to a Python that has it"
)


def tensorflow(*words):
    environment = {**os.environ, "PYTHONPATH": "", "CUDA_VISIBLE_DEVICES": "", "TF_CPP_MIN_LOG_LEVEL": "3"}
    done = subprocess.run([PYTHON, str(SIDE), *map(str, words)], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.fixture
def frames(tmp_path):
    drawn = np.random.default_rng(5).integers(0, 256, (6, 120, 160)).astype(np.uint8)
    np.save(tmp_path / "frames.npy", drawn)
    return drawn


@pytest.mark.parametrize(
    ("kind", "network", "shrink"),
    [("discrete", "shallow", 1), ("continuous", "shallow", 1), ("sac", "shallow", 1), ("discrete", "small", 4)],
)
def test_tensorflow_answers_from_our_graph_as_our_network_does(tmp_path, frames, kind, network, shrink):
    layers, policy = layers_for(kind, network)
    (tmp_path / "model.pb").write_bytes(write_graph(graph_of(layers)))

    tensorflow("answer", f"{tmp_path}/", output_name(kind))

    told = np.load(tmp_path / "answers.npy")
    seen = frames.reshape(6, 120 // shrink, shrink, 160 // shrink, shrink).mean((2, 4), dtype=np.float32) / 255
    if kind == "discrete":
        np.testing.assert_allclose(told, policy.probabilities({CAMERA_NAME: seen}), atol=1e-6)
    else:
        told = np.tanh(told) if kind == "sac" else np.clip(told, -1, 1)
        low, high = (np.array(getattr(RANGES, end), np.float32) for end in ("low", "high"))
        np.testing.assert_allclose(low + (told + 1) / 2 * (high - low), policy.act({CAMERA_NAME: seen}), atol=1e-5)


def test_tensorflow_reads_our_checkpoint(tmp_path):
    arrays = arrays_of(layers_for("continuous", "shallow")[0])
    write_checkpoint(tmp_path / "x.ckpt", arrays)

    tensorflow("read", f"{tmp_path}/")

    read = np.load(tmp_path / "x.npz")
    assert set(read.files) == set(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(read[name], array)


@pytest.mark.parametrize("kind", ["discrete", "continuous", "sac"])
@pytest.mark.parametrize("network", ["shallow", "deep"])
@pytest.mark.parametrize("lone_graph", [False, True])
def test_what_tensorflow_saved_drives_here(tmp_path, frames, kind, network, lone_graph):
    """The deep networks have dense layers before anything is flattened, as Coach builds them."""
    tensorflow("train", kind, network, f"{tmp_path}/")
    METADATA[kind](tmp_path / "model_metadata.json")
    source = tmp_path / "model_3.pb" if lone_graph else tmp_path

    done = import_model(source, tmp_path / "run")

    assert done.checkpoints == (3,)
    policy = load_policy(done.run, "last")
    told = np.load(tmp_path / "answers.npy")
    if kind == "discrete":
        np.testing.assert_allclose(policy.probabilities({CAMERA_NAME: frames}), told, atol=1e-5)
        assert isinstance(policy.spec.observations[CAMERA_NAME], ArraySpec)
        assert policy.spec.actions.count == LISTED.count
    else:
        units = np.tanh(told) if kind == "sac" else np.clip(told, -1, 1)
        low, high = (np.array(getattr(RANGES, end), np.float32) for end in ("low", "high"))
        np.testing.assert_allclose(policy.act({CAMERA_NAME: frames}), low + (units + 1) / 2 * (high - low), atol=1e-4)
    anew = [note for note in done.notes if "begin" in note]
    assert bool(anew) == (lone_graph or kind == "sac")
