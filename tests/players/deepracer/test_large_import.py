"""An archive of a gigabyte is taken in within a stated memory and time, by the command that a user types."""

import subprocess
import sys
import tarfile

import pytest
from tests.formats.tensorflow.policies import layers_for, write_listed

from racecraft.formats.aws.policy_graph import graph_of
from racecraft.formats.aws.policy_weights import arrays_of
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.tensorflow.checkpoint import write_checkpoint
from racecraft.formats.tensorflow.graph import write_graph, write_meta_graph

GIGABYTE = 10**9
STATES = 16
MOST_EXTRA_BYTES = 200 * 10**6
MOST_SECONDS = 60.0
"""Of processor time, which a busy machine does not stretch."""
IMPORTS_ONLY = "import racecraft.cli.app, racecraft.players.deepracer.foreign_model"


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


@pytest.fixture
def archive(tmp_path):
    """A gigabyte, packed: sixteen states of AWS's shallow network, each as a checkpoint and as a frozen graph."""
    layers, _ = layers_for("discrete", "shallow")
    write_checkpoint(tmp_path / "one.ckpt", arrays_of(layers))
    (tmp_path / "one.ckpt.meta").write_bytes(write_meta_graph(graph_of(layers)))
    (tmp_path / "model.pb").write_bytes(write_graph(graph_of(layers)))
    write_listed(tmp_path / "model_metadata.json")
    path = tmp_path / "model.tar.gz"
    with tarfile.open(path, "w:gz", compresslevel=1) as packed:
        packed.add(tmp_path / "model_metadata.json", "mine/model/model_metadata.json")
        for number in range(STATES):
            for end in (".index", ".data-00000-of-00001", ".meta"):
                packed.add(tmp_path / f"one.ckpt{end}", f"mine/model/{number}_Step-{number * 100}.ckpt{end}")
            packed.add(tmp_path / "model.pb", f"mine/model/model_{number}.pb")
    assert path.stat().st_size > GIGABYTE
    return path


@pytest.mark.long
def test_a_gigabyte_is_imported_within_its_memory_and_time(archive, tmp_path):
    base, _ = spent("-c", IMPORTS_ONLY)
    peak, seconds = spent("-m", "racecraft", "import", str(archive), str(tmp_path / "run"))
    print(f"{archive.stat().st_size / 1e6:.0f} MB: base {base / 1e6:.0f} MB, peak {peak / 1e6:.0f} MB, {seconds:.1f} s")
    assert len(Checkpoints(tmp_path / "run" / "checkpoints").entries()) == STATES
    assert peak - base < MOST_EXTRA_BYTES
    assert seconds < MOST_SECONDS


def test_an_import_needs_no_torch(tmp_path):
    """torch alone is two hundred megabytes."""
    layers, _ = layers_for("discrete", "tiny")
    write_checkpoint(tmp_path / "1_Step-1.ckpt", arrays_of(layers))
    (tmp_path / "1_Step-1.ckpt.meta").write_bytes(write_meta_graph(graph_of(layers)))
    write_listed(tmp_path / "model_metadata.json")
    asked = (
        "import sys; from racecraft.players.deepracer.foreign_model import import_model; "
        f"import_model({str(tmp_path)!r}, {str(tmp_path / 'run')!r}); sys.exit('torch' in sys.modules)"
    )
    spent("-c", asked)
