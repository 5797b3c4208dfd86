"""Scripts written for ML-Agents' Python package run unchanged; players are the stand-in, over the real wire."""

import sys
from pathlib import Path

import pytest
from tests.compat.articles import unity_wrapper
from tests.forked import ran

from racecraft.compat.shims import foreign_names, run_script
from racecraft.contract.errors import InputFileError

pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")

IMPORTS = """
import os
import gym
from mlagents_envs.environment import UnityEnvironment
from mlagents_envs.exception import UnityWorkerInUseException
from mlagents_envs.registry import default_registry
from gym_unity.envs import UnityToGymWrapper
"""
PLAY = """
from types import SimpleNamespace
import sys

class Config(dict):
    worker_index = 0

env = UnityEnvWrapper(Config(env_name="Basic"))
print(env.action_space, env.observation_space.shape, sys.argv[1:])
total, done = 0.0, False
seen = env.reset()
while not done:
    seen, reward, done, info = env.step(2)
    total += reward
print(round(total, 3))
env.env.close()
"""


@pytest.fixture(autouse=True)
def _offline(monkeypatch, tmp_path):
    """No manifest can be had, and no scene lies in a cache."""
    monkeypatch.setenv("RACECRAFT_UNITY_MANIFEST", str(tmp_path / "no-manifest.yaml"))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.delenv("SM_CHANNEL_TRAIN", raising=False)


def play(folder, code, *args):
    """Run a script in this process, as `racecraft run` does."""
    script = folder / "train-unity.py"
    script.write_text(code)
    run_script(script, args)


def test_the_published_wrapper_runs_unchanged(tmp_path, capsys, monkeypatch):
    """`default_registry` has no network here: the stand-in plays, and that is said."""
    monkeypatch.chdir(tmp_path)
    play(tmp_path, IMPORTS + unity_wrapper() + PLAY, "--any", "thing")
    told = capsys.readouterr()
    assert told.out.splitlines() == ["Discrete(3) (20,) ['--any', 'thing']", "0.93"]
    assert "builtin:Basic plays instead" in told.err


@pytest.mark.skipif(sys.platform == "win32", reason="a script is no program on Windows")
def test_the_published_wrapper_starts_the_build_that_sagemaker_brings(tmp_path, capsys, monkeypatch):
    """A file that lost its executable bit on the way, in the folder that SM_CHANNEL_TRAIN names."""
    home = Path(__import__("racecraft").__file__).parent.parent
    build = tmp_path / "Basic"
    build.write_text(
        f"#!{sys.executable}\nimport sys; sys.path.insert(0, {str(home)!r})\n"
        "from racecraft.worlds.unity.env.basic_scene import main\nsys.exit(main())\n"
    )
    monkeypatch.setenv("SM_CHANNEL_TRAIN", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    play(tmp_path, IMPORTS + unity_wrapper() + PLAY)
    assert capsys.readouterr().out.splitlines()[-1] == "0.93"


LOW_LEVEL = """
import uuid
import numpy as np
from mlagents_envs.base_env import ActionTuple
from mlagents_envs.environment import UnityEnvironment
from mlagents_envs.exception import UnityActionException
from mlagents_envs.side_channel import raw_bytes_channel, SideChannel
from mlagents_envs.side_channel.engine_configuration_channel import EngineConfigurationChannel
from mlagents_envs.side_channel.environment_parameters_channel import EnvironmentParametersChannel
from mlagents_envs.side_channel.stats_side_channel import StatsSideChannel

engine, parameters = EngineConfigurationChannel(), EnvironmentParametersChannel()
raw = raw_bytes_channel.RawBytesChannel(uuid.uuid4())
env = UnityEnvironment("builtin:Basic", no_graphics=True, additional_args=["--agents", "3"],
                       side_channels=[engine, parameters, StatsSideChannel(), raw])
engine.set_configuration_parameters(time_scale=20.0)
parameters.set_float_parameter("gravity", 9.81)
env.reset()
(name,) = env.behavior_specs
spec = env.behavior_specs[name]
print(name, spec.observation_specs[0].shape, spec.action_spec.discrete_branches, spec.action_spec.is_discrete())
decisions, ended = env.get_steps(name)
env.set_action_for_agent(name, decisions.agent_id[1], ActionTuple(discrete=np.array([[2]])))
env.step()
print([int(row.argmax()) for row in env.get_steps(name)[0].obs[0]])
try:
    env.set_actions(name, spec.action_spec.empty_action(2))
except UnityActionException as error:
    print(error)
for _ in range(6):
    env.set_actions(name, ActionTuple(discrete=np.array([[0], [2], [1]])))
    env.step()
    decisions, ended = env.get_steps(name)
    for agent in ended:
        print(agent, round(ended[agent].reward, 2), ended[agent].interrupted)
print(decisions.action_mask[0].any())
env.close()
"""


def test_the_low_level_words_drive_many_agents(tmp_path, capsys):
    play(tmp_path, LOW_LEVEL)
    assert capsys.readouterr().out.splitlines() == [
        "Basic?team=0 (20,) (3,) True",
        "[10, 11, 10]",
        "'Basic?team=0': actions of shapes ((2, 0), (2, 1)); expected ((3, 0), (3, 1))",
        "2 0.09 False",
        "1 0.99 False",
        "3 0.09 False",
        "False",
    ]


def test_outside_a_script_the_names_are_nobodys():
    for name in ("mlagents_envs", "gym_unity"):
        with foreign_names():
            __import__(name)
        assert name not in sys.modules
        with pytest.raises(ModuleNotFoundError):
            __import__(name)


def test_a_taken_port_is_a_worker_in_use():
    import socket

    with foreign_names(), socket.socket() as taken:
        from mlagents_envs.environment import UnityEnvironment
        from mlagents_envs.exception import UnityEnvironmentException, UnityWorkerInUseException

        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(UnityWorkerInUseException, match="worker 3 is in use"):
            UnityEnvironment("builtin:Basic", worker_id=3, base_port=taken.getsockname()[1] - 3)
        with pytest.raises(UnityEnvironmentException, match="nowhere"):
            UnityEnvironment("nowhere")
        with pytest.raises(UnityEnvironmentException, match="worker_id 0"):
            UnityEnvironment(None, worker_id=1)


def test_scenes_without_a_stand_in_are_refused_offline():
    with foreign_names():
        from mlagents_envs.exception import UnityEnvironmentException
        from mlagents_envs.registry import default_registry

        with pytest.raises(UnityEnvironmentException, match=r"no-manifest\.yaml"):
            default_registry["3DBall"].make()
        assert list(default_registry) == ["Basic"]


def test_side_channel_messages_are_read_as_they_were_written():
    with foreign_names():
        from mlagents_envs.side_channel.incoming_message import IncomingMessage
        from mlagents_envs.side_channel.outgoing_message import OutgoingMessage

        message = OutgoingMessage()
        message.write_bool(True)
        message.write_int32(-7)
        message.write_float32(0.5)
        message.write_string("mass")
        message.write_float32_list([1.0, 2.0])
        heard = IncomingMessage(bytes(message.buffer))
        assert (heard.read_bool(), heard.read_int32(), heard.read_float32()) == (True, -7, 0.5)
        assert (heard.read_string(), heard.read_float32_list(), heard.read_int32(99)) == ("mass", [1.0, 2.0], 99)


def test_the_old_gym_makes_and_wraps():
    with foreign_names():
        import gym

        class Twice(gym.RewardWrapper):
            def reward(self, reward):
                return 2 * reward

        env = Twice(gym.make("CartPole-v1"))
        env.seed(1)
        assert env.reset().shape == (4,)
        seen, reward, done, info = env.step(env.action_space.sample())
        assert (reward, done) == (2.0, False)
        assert isinstance(env.observation_space, gym.spaces.Box)
        env.close()


def test_a_script_sees_its_neighbours_and_leaves_no_trace(tmp_path, capsys):
    (tmp_path / "racecraft_test_neighbour.py").write_text("WORD = 'hello'")
    before = list(sys.path), list(sys.argv), list(sys.meta_path)
    with pytest.raises(SystemExit, match="3"):
        play(tmp_path, "import sys, racecraft_test_neighbour as n; print(n.WORD, __name__); sys.exit(3)")
    assert capsys.readouterr().out == "hello __main__\n"
    assert (sys.path, sys.argv, sys.meta_path) == before
    with pytest.raises(InputFileError, match="no such file"):
        run_script(tmp_path / "absent.py")


def test_the_command_hands_options_on_to_the_script(tmp_path):
    (tmp_path / "script.py").write_text("import sys, gym; print(sys.argv[1:])")
    done = ran(["run", "script.py", "--json", "-x", "1", "--help"], tmp_path)
    assert done.stdout == "['--json', '-x', '1', '--help']\n"
