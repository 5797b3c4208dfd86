"""A process that was warmed up trains as a fresh one does."""

import subprocess
import sys

import numpy as np
import pytest
from safetensors.numpy import load_file

TRAIN = """
import sys
from pathlib import Path
if __name__ == "__main__":
    from racecraft.training import worlds
    from racecraft.training.callbacks import Silent
    from racecraft.worlds.deepracer.training.plan import RaceRequest
    from racecraft.worlds.deepracer.training.warm_up import warm_up
    if sys.argv[1] == "warm":
        warm_up()
    request = RaceRequest(
        stops=("iterations=2",), run=Path(sys.argv[2]), preset="fast", overrides=("rollout.horizon=32",)
    )
    worlds.train(request, Silent(), on_message=lambda line: None)
"""


@pytest.mark.long
def test_a_warm_process_learns_the_same_to_the_bit(tmp_path):
    script = tmp_path / "train.py"
    script.write_text(TRAIN, encoding="utf-8")
    weights = []
    for how in ("cold", "warm"):
        subprocess.run([sys.executable, script, how, tmp_path / how], check=True)
        weights.append(load_file(tmp_path / how / "checkpoints" / "2.policy.safetensors"))
    cold, warm = weights
    assert cold.keys() == warm.keys()
    assert all(np.array_equal(cold[name], warm[name]) for name in cold)
