"""The command line, run in this process."""

import sys
from dataclasses import dataclass

import pytest

from racecraft.cli.app import main

TINY = (
    "--set", "camera.width=16", "--set", "camera.height=12", "--set", "rollout.num_worlds=4",
    "--set", "rollout.horizon=16", "--set", "evaluation.episodes=2", "--set", "race.max_episode_seconds=2",
    "--set", "network.conv_filters=4", "--set", "network.conv_kernels=4", "--set", "network.conv_strides=2",
    "--set", "network.hidden_units=8", "--set", "runtime.threads=1", "--preset=fast",
)  # fmt: skip
"""Words of a training that takes no time and learns nothing; every second one but the last is a setting.

It is the car that crawls: one frame, so that every export takes it, and a reward that keeps nothing, so that a run that
was broken off goes on to the bit.
"""


@dataclass
class Said:
    """What a command came to."""

    code: int
    out: str
    err: str


@pytest.fixture
def racecraft(monkeypatch, capsys, tmp_path):
    """Run `racecraft …` in an empty folder; return exit code, standard output and standard error."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["racecraft", *map(str, arguments)])
        code = 0
        try:
            main()
        except SystemExit as exit_:
            code = exit_.code or 0
        captured = capsys.readouterr()
        return Said(code, captured.out, captured.err)

    return run
