"""A user's environment that raises ends a training with a letter: file, line, what it raised. Nothing else is lost."""

import json
import re

import pytest
from tests.cli.conftest import racecraft  # noqa: F401 - the fixture
from tests.cluster.workers_here import spread_here
from tests.compat.guessing import GUESS, PLAIN, script
from tests.forked import ran
from tests.jobs.conftest import home  # noqa: F401 - the fixture

from racecraft.compat.shims import run_script
from racecraft.contract.errors import EnvironmentFailedError, UserInputError
from racecraft.formats.run_folder import RunFolder
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.gymnasium.training.trainer import GymRequest

FINE = """\
import gymnasium, numpy as np


class Road(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-1, 1, (3,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)
    ticks = 0

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.tick = 0
        return np.zeros(3, np.float32), {}

    def step(self, action):
        self.tick += 1
        Road.ticks += 1
        return np.zeros(3, np.float32), 1.0, self.tick >= 10, False, {}


"""
TINY = ("--no-pictures", "--set=rollout.horizon=16", "--set=rollout.num_worlds=4", "--set=evaluation.every=100")
LATE = """\
class Mine(Road):
    def step(self, action):
        if Road.ticks > 300:
            return super().step(self.actions_left[action])
        return super().step(action)
"""
WORLD = """\
import numpy as np
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec


class Mine:
    def __init__(self, num_worlds):
        self.spec = WorldSpec("mine", num_worlds, 1, {"x": ArraySpec((2,), np.float32, -1, 1)}, DiscreteActions(2))
        self.tick = 0

    def reset(self, buffers, seed):
        buffers.observations["x"][:], buffers.active[:] = 0, True

    def step(self, actions, buffers):
        self.tick += 1
        10 / (100 - self.tick)
        buffers.observations["x"][:], buffers.final_observations["x"][:], buffers.active[:] = 0, 0, True
        buffers.reward[:], buffers.terminated[:], buffers.truncated[:] = 1, self.tick % 10 == 0, False

    def save_state(self):
        return {"tick": np.array(self.tick)}

    def load_state(self, state, buffers):
        self.tick = int(state["tick"])

    def close(self):
        pass
"""


def written(folder, module, text):
    """Write a module; no two tests of one process share a name."""
    (folder / f"{module}.py").write_text(text)
    return f"{module}:Mine"


def line_of(text, part):
    """Return the number of the one line that holds a part."""
    (number,) = [number for number, line in enumerate(text.splitlines(), 1) if part in line]
    return number


AT_ONCE = {
    "a step": (
        "class Mine(Road):\n    def step(self, action):\n        return self.tracks[0]\n",
        "self.tracks[0]",
        "Mine.step raised AttributeError: 'Mine' object has no attribute 'tracks'",
    ),
    "its making": (
        "class Mine(Road):\n    def __init__(self):\n        self.road = 1 / 0\n",
        "1 / 0",
        "Mine raised ZeroDivisionError: division by zero as it was made",
    ),
    "a package below it": (
        "class Mine(Road):\n    def step(self, action):\n        return np.concatenate([])\n",
        "np.concatenate",
        "Mine.step raised ValueError: need at least one array",
    ),
    "leaving": (
        "class Mine(Road):\n    def step(self, action):\n        raise SystemExit('enough')\n",
        "enough",
        "Mine.step raised SystemExit: enough",
    ),
    "four things": (
        "class Mine(Road):\n    def step(self, action):\n        return np.zeros(3), 1.0, False, {}\n",
        "def step(self, action):  # own",
        "Mine.step gave 4 things; expected (observation, reward, terminated, truncated, info)",
    ),
    "what it did not promise": (
        "class Mine(Road):\n    def step(self, action):\n        return np.zeros(4), 1.0, False, False, {}\n",
        "def step(self, action):  # own",
        "Mine.step gave ndarray of shape (4,) as observation",
    ),
    "no reward": (
        "class Mine(Road):\n    def step(self, action):\n        return np.zeros(3), None, False, False, {}\n",
        "def step(self, action):  # own",
        "Mine.step gave None as reward",
    ),
}


@pytest.mark.parametrize("what", AT_ONCE)
def test_what_fails_at_once_is_named_with_its_line(racecraft, tmp_path, what):  # noqa: F811
    own, place, letter = AT_ONCE[what]
    text = FINE + own.replace("def step(self, action):\n", "def step(self, action):  # own\n")
    module = f"fails_by_{what.replace(' ', '_')}"
    said = racecraft("gym", "train", written(tmp_path, module, text), "--stop", "iterations=2", "--run", "run", *TINY)
    assert said.code == 2
    assert f"racecraft: {module}.py:{line_of(text, place)}: {letter}" in said.err
    assert "Mend" in said.err
    assert "Traceback" not in said.err


def test_what_was_learned_until_then_stays_and_goes_on_once_it_is_mended(racecraft, tmp_path):  # noqa: F811
    named = written(tmp_path, "fails_late", FINE + LATE)
    said = racecraft("gym", "train", named, "--stop", "iterations=9", "--run", "run", *TINY)
    assert said.code == 2
    assert "what was learned until then stands in run; --run run --resume goes on from there" in said.err + said.out
    learned = len((tmp_path / "run" / "metrics.jsonl").read_text().splitlines())
    assert learned == 4
    RunFolder.open(tmp_path / "run").lock().release()

    (tmp_path / "fails_late.py").write_text(FINE + LATE.replace("self.actions_left[action]", "action"))
    told = ran(["gym", "train", "--run=run", "--resume", "--stop=iterations=9"], tmp_path)
    assert told.returncode == 0, told.stderr
    rows = (tmp_path / "run" / "metrics.jsonl").read_text().splitlines()
    assert [json.loads(row)["iteration"] for row in rows] == list(range(1, 10))


def test_a_world_of_a_users_own_class_is_told_of_alike(racecraft, tmp_path):  # noqa: F811
    named = written(tmp_path, "own_world_fails", WORLD)
    said = racecraft("gym", "train", named, "--stop", "iterations=30", "--run", "run", *TINY)
    assert said.code == 2
    line = line_of(WORLD, "10 / (100")
    assert f"racecraft: own_world_fails.py:{line}: Mine.step raised ZeroDivisionError: division by zero" in said.err
    assert (tmp_path / "run" / "metrics.jsonl").exists()


def test_in_a_job_the_letter_is_its_reason(racecraft, home, tmp_path):  # noqa: F811
    named = written(tmp_path, "fails_in_a_job", FINE + LATE)
    said = racecraft("gym", "train", named, "--stop", "iterations=9", "--detach", *TINY)
    assert said.code == 0, said.err
    assert racecraft("jobs", "wait", "gym-1").code == 1
    told = json.loads(racecraft("jobs", "show", "gym-1", "--json").out)
    assert told["status"] == "Failed"
    line = line_of(FINE + LATE, "actions_left")
    assert f"fails_in_a_job.py:{line}: Mine.step raised AttributeError" in told["reason"]
    assert (tmp_path / "runs" / "gym-1" / "metrics.jsonl").exists()


def test_a_workers_environment_is_told_of_by_the_training(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    named = written(tmp_path, "fails_at_a_worker", FINE + LATE)
    small = ("rollout.horizon=16", "rollout.num_worlds=4", "evaluation.every=100", "runtime.threads=1")
    spread, transport = spread_here(2)
    request = GymRequest(named, run=tmp_path / "run", stops=("iterations=9",), overrides=small)
    told = []
    with pytest.raises(UserInputError, match=r"fails_at_a_worker\.py:\d+: Mine.step raised AttributeError"):
        train(request, NullCallback(), told.append, spread)
    assert any("what was learned until then stands in" in line for line in told)
    assert transport.closed


SEEN = "return seen, rewards, dones, {}"


@pytest.mark.parametrize(
    ("text", "mine", "letter"),
    [
        (GUESS.replace(SEEN, "return self.t[0]"), "self.t[0]", "Guess.step raised TypeError: 'int' object is not"),
        (GUESS.replace(SEEN, "return seen, None, dones, {}"), "def step(", "Guess.step gave "),
        (
            GUESS.replace("def __init__(self):", "def __init__(self):\n        1 / 0"),
            "1 / 0",
            "the environment raised ZeroDivisionError",
        ),
    ],
)
def test_a_scripts_environment_of_several_agents_is_told_of(tmp_path, monkeypatch, text, mine, letter):
    monkeypatch.chdir(tmp_path)
    whole = script().replace(GUESS, text)
    (tmp_path / "train.py").write_text(whole)
    line = line_of(text, mine)
    with pytest.raises(EnvironmentFailedError, match=rf"^train\.py:{line}: {re.escape(letter)}"):
        run_script("train.py")


def test_a_scripts_environment_of_one_agent_is_told_of_without_pythons_traceback(tmp_path):
    whole = PLAIN.replace("float(action)", "float(action) / (4 - self.t)") + script("Plain")
    (tmp_path / "train.py").write_text(whole)
    told = ran(["run", "train.py"], tmp_path)
    assert told.returncode == 2, told.stderr
    line = line_of(whole, "(4 - self.t)")
    assert f"racecraft: train.py:{line}: Plain.step raised ZeroDivisionError" in told.stderr
    assert "Traceback" not in told.stderr
    (run,) = (tmp_path / "runs").iterdir()
    assert (run / "job.json").exists()
