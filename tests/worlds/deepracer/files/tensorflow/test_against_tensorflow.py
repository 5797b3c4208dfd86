"""TensorFlow itself is the judge: it reads what we write, and we read what it saved and froze.

Set RACECRAFT_TENSORFLOW_PYTHON to a Python that has it (`pip install tensorflow-cpu` in an environment of its own).
"""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.worlds.deepracer.files.tensorflow.policies import LISTED, METADATA, RANGES, layers_for, moments

from racecraft.players.trained import load_policy
from racecraft.worlds.deepracer.export.agreement import as_fed, averages
from racecraft.worlds.deepracer.files.policy_graph import graph_of, output_name
from racecraft.worlds.deepracer.files.policy_weights import arrays_of
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import write_checkpoint
from racecraft.worlds.deepracer.files.tensorflow.graph import write_graph
from racecraft.worlds.deepracer.players.aws_model import import_model

FRONT, STEREO, OLD = "FRONT_FACING_CAMERA", "STEREO_CAMERAS", "observation"
LIDAR, SECTORS = "LIDAR", "SECTOR_LIDAR"
PYTHON = os.environ.get("RACECRAFT_TENSORFLOW_PYTHON", "")
SIDE = Path(__file__).with_name("tensorflow_side.py")

pytestmark = pytest.mark.skipif(
    not PYTHON, reason="needs TensorFlow: set RACECRAFT_TENSORFLOW_PYTHON to a Python that has it"
)


def tensorflow(*words):
    environment = {**os.environ, "PYTHONPATH": "", "CUDA_VISIBLE_DEVICES": "", "TF_CPP_MIN_LOG_LEVEL": "3"}
    done = subprocess.run([PYTHON, str(SIDE), *map(str, words)], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]


def laid_out(folder, sensors, network="shallow"):
    """Write what TensorFlow is shown, and return it as our policy sees it."""
    whole, shrink = moments(sensors), 4 if network == "small" else 1
    pairs = zip(sorted(whole), sorted(sensors), strict=True)
    np.savez(folder / "seen.npz", **{theirs: as_fed(whole[ours], whole[ours].ndim > 2) for ours, theirs in pairs})
    return {name: averages(one, shrink) if shrink > 1 and one.ndim > 2 else one for name, one in whole.items()}


def told_commands(kind, told):
    units = np.tanh(told) if kind == "sac" else np.clip(told, -1, 1)
    low, high = (np.array(getattr(RANGES, end), np.float32) for end in ("low", "high"))
    return low + (units + 1) / 2 * (high - low)


@pytest.mark.parametrize(
    ("kind", "network", "sensors"),
    [("discrete", "shallow", (FRONT,)), ("continuous", "shallow", (STEREO,)), ("sac", "shallow", (FRONT,)),
     ("discrete", "small", (FRONT,)), ("discrete", "shallow", (STEREO, SECTORS)), ("sac", "tiny", (OLD, LIDAR)),
     ("continuous", "small", (STEREO, LIDAR))],
)  # fmt: skip
def test_tensorflow_answers_from_our_graph_as_our_network_does(tmp_path, kind, network, sensors):
    layers, policy = layers_for(kind, network, sensors)
    (tmp_path / "model.pb").write_bytes(write_graph(graph_of(layers)))
    seen = laid_out(tmp_path, sensors, network)

    tensorflow("answer", f"{tmp_path}/", output_name(kind))

    told = np.load(tmp_path / "answers.npy")
    if kind == "discrete":
        np.testing.assert_allclose(told, policy.probabilities(seen), atol=1e-6)
    else:
        np.testing.assert_allclose(told_commands(kind, told), policy.act(seen), atol=1e-5)


def test_tensorflow_reads_our_checkpoint(tmp_path):
    arrays = arrays_of(layers_for("continuous", "shallow")[0])
    write_checkpoint(tmp_path / "x.ckpt", arrays)

    tensorflow("read", f"{tmp_path}/")

    read = np.load(tmp_path / "x.npz")
    assert set(read.files) == set(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(read[name], array)


@pytest.mark.parametrize("kind", ["discrete", "continuous", "sac"])
@pytest.mark.parametrize(("network", "sensors"), [
    ("shallow", (FRONT,)), ("deep", (FRONT,)), ("tiny", (STEREO, SECTORS)), ("tiny", (OLD, LIDAR)),
])  # fmt: skip
@pytest.mark.parametrize("lone_graph", [False, True])
def test_what_tensorflow_saved_drives_here(tmp_path, kind, network, sensors, lone_graph):
    """The deep networks have dense layers before anything is flattened, as Coach builds them."""
    seen = laid_out(tmp_path, sensors)
    tensorflow("train", kind, network, f"{tmp_path}/", ",".join(sensors))
    METADATA[kind](tmp_path / "model_metadata.json", sensors=sensors)
    source = tmp_path / "model_3.pb" if lone_graph else tmp_path

    done = import_model(source, tmp_path / "run")

    assert done.checkpoints == (3,)
    policy, told = load_policy(done.run, "last"), np.load(tmp_path / "answers.npy")
    if kind == "discrete":
        np.testing.assert_allclose(policy.probabilities(seen), told, atol=1e-5)
        assert policy.spec.actions.count == LISTED.count
    else:
        np.testing.assert_allclose(policy.act(seen), told_commands(kind, told), atol=1e-4)
    assert any("was not asked" in note for note in done.notes) is False
    assert any("begin" in note for note in done.notes) == (lone_graph or kind == "sac")
