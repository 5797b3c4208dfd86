"""The command line, run in this process."""

import shutil
import sys
from dataclasses import dataclass

import pytest

from racecraft.cli.app import main
from racecraft.worlds.deepracer.analysis.films import film, moments

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


def typed(*words):
    """Run `racecraft …` in this process; return its exit code."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["racecraft", *map(str, words)])
        try:
            main()
        except SystemExit as ended:
            return ended.code or 0
    return 0


@pytest.fixture
def racecraft(monkeypatch, capsys, tmp_path):
    """Run `racecraft …` in an empty folder; return exit code, standard output and standard error."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(moments, "HELD_SECONDS", 0.1)  # how long a film shows its last picture
    monkeypatch.setattr(film, "SIZES", {name: (160, 120) for name in film.SIZES})

    def run(*arguments):
        code = typed(*arguments)
        return Said(code, *capsys.readouterr())

    return run


@pytest.fixture(scope="session")
def trained(tmp_path_factory):
    """The folder of a TINY car after its first iteration; it stays as it is."""
    folder = tmp_path_factory.mktemp("trained")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert typed("train", "--run", "r", "--stop", "iterations=1", "--no-pictures", *TINY) == 0
    return folder / "r"


@pytest.fixture
def run(trained, tmp_path):
    """A copy of that run, `r` in the folder in which `racecraft` runs."""
    return shutil.copytree(trained, tmp_path / "r")
