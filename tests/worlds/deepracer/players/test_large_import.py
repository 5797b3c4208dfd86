"""A large archive is taken in within a stated memory and time, by the command that a user types."""

import subprocess
import sys
import tarfile

import pytest
from tests.worlds.deepracer.files.tensorflow.policies import layers_for, two_eyed_layers, write_listed

from racecraft.formats.checkpoint import Checkpoints
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME
from racecraft.worlds.deepracer.env.sensors import STEREO
from racecraft.worlds.deepracer.files.policy_graph import graph_of
from racecraft.worlds.deepracer.files.policy_weights import arrays_of
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import write_checkpoint
from racecraft.worlds.deepracer.files.tensorflow.graph import write_graph, write_meta_graph

GIGABYTE = 10**9
MAX_BYTES = {"shallow": 300 * 10**6, "two eyes": 10**9}
"""Resident at the peak, Python and all that is imported included; a network lies in memory as a whole."""
MAX_SECONDS = 60.0
"""Of processor time, which a busy machine does not stretch."""


LAUNCHER = """
import os, sys
quiet = [(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)]
child = os.posix_spawn(sys.executable, [sys.executable, *sys.argv[1:]], os.environ, file_actions=quiet)
_, status, usage = os.wait4(child, 0)
print(usage.ru_maxrss, usage.ru_utime + usage.ru_stime)
sys.exit(os.waitstatus_to_exitcode(status))
"""
"""A program's peak counts that of the process it came from: these tests are large, so a small one stands between."""


def spent(*words):
    """Run Python in a child, and return (its peak resident bytes, its seconds of processor time)."""
    done = subprocess.run([sys.executable, "-c", LAUNCHER, *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    peak, seconds = done.stdout.split()
    return int(peak) * (1 if sys.platform == "darwin" else 1024), float(seconds)


def packed(folder, layers, sensors, states, mode="w:gz"):
    """Return an archive of a model with so many states, each as a checkpoint and as a frozen graph."""
    write_checkpoint(folder / "one.ckpt", arrays_of(layers))
    (folder / "one.ckpt.meta").write_bytes(write_meta_graph(graph_of(layers)))
    (folder / "model.pb").write_bytes(write_graph(graph_of(layers)))
    write_listed(folder / "model_metadata.json", sensors=sensors)
    path = folder / "model.tar.gz"
    with tarfile.open(path, mode, **({"compresslevel": 1} if mode == "w:gz" else {})) as archive:
        archive.add(folder / "model_metadata.json", "mine/model/model_metadata.json")
        for number in range(states):
            for end in (".index", ".data-00000-of-00001", ".meta"):
                archive.add(folder / f"one.ckpt{end}", f"mine/model/{number}_Step-{number * 100}.ckpt{end}")
            archive.add(folder / "model.pb", f"mine/model/model_{number}.pb")
    return path


@pytest.mark.long
@pytest.mark.parametrize(("network", "states"), [("shallow", 16), ("two eyes", 2)])
def test_a_gigabyte_is_imported_within_its_memory_and_time(network, states, tmp_path):
    """Of AWS's usual network, 94 MB a state; and of its largest, 691 MB a state."""
    if network == "shallow":
        archive = packed(tmp_path, layers_for("discrete", "shallow")[0], (CAMERA_NAME,), states)
    else:
        archive = packed(tmp_path, two_eyed_layers(512), (STEREO,), states)
    assert archive.stat().st_size > GIGABYTE
    peak, seconds = spent("-m", "racecraft", "import", str(archive), str(tmp_path / "run"))
    print(f"{network}: {archive.stat().st_size / 1e6:.0f} MB, peak {peak / 1e6:.0f} MB, {seconds:.1f} s")
    assert len(Checkpoints(tmp_path / "run" / "checkpoints").entries()) == states
    assert peak < MAX_BYTES[network]
    assert seconds < MAX_SECONDS


@pytest.mark.parametrize("kind", ["checkpoint", "lone graph"])
def test_an_import_needs_no_torch(kind, tmp_path):
    """torch alone is two hundred megabytes."""
    layers, _ = layers_for("discrete", "tiny")
    if kind == "checkpoint":
        write_checkpoint(tmp_path / "1_Step-1.ckpt", arrays_of(layers))
        (tmp_path / "1_Step-1.ckpt.meta").write_bytes(write_meta_graph(graph_of(layers)))
    else:
        (tmp_path / "model.pb").write_bytes(write_graph(graph_of(layers)))
    write_listed(tmp_path / "model_metadata.json")
    asked = (
        "import sys; from racecraft.worlds.deepracer.players.aws_model import import_model; "
        f"import_model({str(tmp_path)!r}, {str(tmp_path / 'run')!r}); sys.exit('torch' in sys.modules)"
    )
    spent("-c", asked)
