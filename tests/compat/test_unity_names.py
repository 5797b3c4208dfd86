"""What scripts for ML-Agents rely on, name by name; players are stand-ins, over the real wire."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.forked import ran

import racecraft
from racecraft.compat.shims import foreign_names

pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")

HOME = Path(racecraft.__file__).parent.parent
SCENES = Path(__file__).parents[1] / "worlds" / "unity" / "env"


@pytest.fixture(autouse=True)
def _offline(monkeypatch, tmp_path):
    monkeypatch.setenv("RACECRAFT_UNITY_MANIFEST", str(tmp_path / "no-manifest.yaml"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))


def run(folder, code, path=()):
    """Run a script as its user does, in a process of its own, and return what it printed."""
    script = folder / "script.py"
    script.write_text(code)
    search = os.pathsep.join(map(str, [*path, HOME]))
    done = ran(["run", script], folder, PYTHONPATH=search)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def test_an_action_tuple_may_be_filled_one_kind_at_a_time():
    with foreign_names():
        from mlagents_envs.base_env import ActionTuple

        alone = ActionTuple()
        alone.add_discrete(np.array([[2], [1]]))
        assert (alone.continuous.shape, alone.discrete.dtype) == ((2, 0), np.int32)
        alone.add_continuous(np.array([[0.5], [1.5]]))
        assert (alone.continuous.tolist(), alone.discrete.tolist()) == ([[0.5], [1.5]], [[2], [1]])
        numbers = ActionTuple()
        numbers.add_continuous(np.ones((3, 2)))
        assert (numbers.continuous.dtype, numbers.discrete.shape) == (np.float32, (3, 0))


def test_an_action_with_discrete_choices_alone_reaches_the_scene():
    with foreign_names():
        from mlagents_envs.base_env import ActionTuple
        from mlagents_envs.environment import UnityEnvironment

        env = UnityEnvironment("builtin:Basic", no_graphics=True)
        env.reset()
        (name,) = env.behavior_specs
        (agent,) = env.get_steps(name)[0]
        right = ActionTuple()
        right.add_discrete(np.array([[2]]))
        env.set_action_for_agent(name, agent, right)
        env.step()
        env.set_actions(name, right)
        env.step()
        assert env.get_steps(name)[0][agent].obs[0].argmax() == 12
        env.close()


def test_float_properties_that_the_scene_sends_are_read_name_first():
    with foreign_names():
        from mlagents_envs.side_channel.float_properties_channel import FloatPropertiesChannel
        from mlagents_envs.side_channel.side_channel_manager import SideChannelManager

        said, heard = FloatPropertiesChannel(), FloatPropertiesChannel()
        said.set_property("gravity", -9.5)
        SideChannelManager([heard]).process_side_channel_message(
            SideChannelManager([said]).generate_side_channel_messages()
        )
        assert heard.get_property_dict_copy() == {"gravity": -9.5}


def test_side_channels_of_one_id_are_refused_and_cut_bytes_named():
    with foreign_names():
        from mlagents_envs.exception import UnityEnvironmentException
        from mlagents_envs.side_channel.float_properties_channel import FloatPropertiesChannel
        from mlagents_envs.side_channel.side_channel_manager import SideChannelManager

        with pytest.raises(UnityEnvironmentException, match="60ccf7d0"):
            SideChannelManager([FloatPropertiesChannel(), FloatPropertiesChannel()])
        with pytest.raises(UnityEnvironmentException, match="cut or lies"):
            SideChannelManager([]).process_side_channel_message(b"123")


def test_unknown_scenes_are_refused_with_the_nearest_known(tmp_path, monkeypatch):
    manifest = tmp_path / "manifest.yaml"
    manifest.write_text("environments:\n  - Tennis: {linux_url: no.zip, description: a game, expected_reward: 1.5}\n")
    with foreign_names():
        from mlagents_envs.registry import default_registry

        with pytest.raises(KeyError, match=r"no scene is named 'Walker'.*no-manifest\.yaml"):
            default_registry["Walker"]
        assert "Basic" in default_registry
        assert "Walker" not in default_registry
        assert default_registry["Basic"].expected_reward == 0.0, "nothing tells"
        monkeypatch.setenv("RACECRAFT_UNITY_MANIFEST", str(manifest))
        assert default_registry["Tennis"].expected_reward == 1.5
        with pytest.raises(KeyError, match="Did you mean 'Tennis'"):
            default_registry["Tenis"]


def test_registries_of_ones_own_hold_entries_and_manifests(tmp_path):
    manifest = tmp_path / "mine.yaml"
    manifest.write_text("environments:\n  - Tennis: {}\n")
    with foreign_names():
        from mlagents_envs.registry import UnityEnvRegistry
        from mlagents_envs.registry.remote_registry_entry import RemoteRegistryEntry

        mine = UnityEnvRegistry()
        absent = (tmp_path / "absent.zip").as_uri()
        mine.register(
            RemoteRegistryEntry("Basic", 0.9, "ours", absent, absent, absent, ["--agents", "2"], str(tmp_path))
        )
        mine.register_from_yaml(str(manifest))
        assert sorted(mine) == ["Basic", "Tennis"]
        env = mine["Basic"].make(no_graphics=True)  # the zip is not there: our stand-in plays
        env.reset()
        assert len(env.get_steps("Basic?team=0")[0]) == 2
        env.close()
        mine.clear()
        assert len(mine) == 0


SENDS_PICTURES = """
import sys
sys.path[:0] = [{home!r}, {scenes!r}]
from scenes import PictureScene
from racecraft.worlds.unity.env.player import Player
Player(PictureScene(), int(sys.argv[sys.argv.index("--mlagents-port") + 1]), package_version={version!r}).live()
"""
SEES_PICTURES = """
import numpy
{imports}
from mlagents_envs.environment import UnityEnvironment
env = UnityEnvironment({player!r}, no_graphics=True)
env.reset()
camera, grid, numbers = env.get_steps("Eyes")[0].obs
specs = env.behavior_specs["Eyes"].observation_specs
assert [spec.shape for spec in specs] == [seen.shape[1:] for seen in (camera, grid, numbers)]
numpy.savez({file!r}, camera=camera[0], grid=grid[0])
env.close()
"""


@pytest.mark.parametrize(
    ("version", "imports", "layout"),
    [("3.0.0", "", "CHW"), ("3.0.0", "from gym_unity.envs import UnityToGymWrapper", "HWC"), ("2.3.0", "", "HWC")],
)
@pytest.mark.skipif(sys.platform == "win32", reason="a script is no program there")
def test_pictures_have_the_axes_that_the_package_of_the_script_gave_them(tmp_path, version, imports, layout):
    player, file = tmp_path / "Pictures", tmp_path / "seen.npz"
    player.write_text(
        f"#!{sys.executable}" + SENDS_PICTURES.format(home=str(HOME), scenes=str(SCENES), version=version)
    )
    run(tmp_path, SEES_PICTURES.format(imports=imports, player=str(player), file=str(file)))
    seen = np.load(file)
    sent = (
        np.random.default_rng(1).integers(0, 256, (6, 8, 5), dtype=np.uint8) / 255,
        (np.random.default_rng(2).random((3, 4, 2)).astype(np.float32)),
    )
    for name, picture in zip(("camera", "grid"), sent, strict=True):
        expected = picture.transpose(2, 0, 1) if layout == "CHW" else picture
        np.testing.assert_allclose(seen[name], expected, rtol=1e-6)


FORKSERVER = """
import multiprocessing
import gym
from mlagents_envs.environment import UnityEnvironment


def play(agents):
    from gym_unity.envs import UnityToGymWrapper
    env = UnityToGymWrapper(UnityEnvironment("builtin:Basic", no_graphics=True))
    assert isinstance(env, gym.Env)
    env.reset()
    total, done = 0.0, False
    while not done:
        seen, reward, done, info = env.step(2)
        total += reward
    env.close()
    return round(total, 2)


if __name__ == "__main__":
    with multiprocessing.get_context("forkserver").Pool(2) as pool:
        print(pool.map(play, [1, 2]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="forkserver is not known there")
def test_processes_that_a_script_begins_are_lent_the_names_too(tmp_path):
    assert run(tmp_path, FORKSERVER) == "[0.93, 0.93]\n"


VECTOR = """
import gymnasium
import numpy as np
from stable_baselines3.common.vec_env import SubprocVecEnv
from mlagents_envs.environment import UnityEnvironment
from mlagents_envs.envs.unity_gym_env import UnityToGymWrapper


class Scene(gymnasium.Env):
    def __init__(self):
        self.inner = UnityToGymWrapper(UnityEnvironment("builtin:Basic", no_graphics=True))
        self.action_space, self.observation_space = self.inner.action_space, self.inner.observation_space

    def reset(self, seed=None, options=None):
        return self.inner.reset(), {}

    def step(self, action):
        seen, reward, done, info = self.inner.step(action)
        return seen, reward, done, False, {}

    def close(self):
        self.inner.close()


if __name__ == "__main__":
    env = SubprocVecEnv([Scene], start_method="spawn")
    env.reset()
    seen, rewards, done, info = env.step(np.array([2]))
    print(seen.argmax(1).tolist(), rewards.round(2).tolist())
    env.close()
"""


def test_stable_baselines3_workers_are_lent_the_names_too(tmp_path):
    pytest.importorskip("stable_baselines3")
    assert run(tmp_path, VECTOR) == "[11] [-0.01]\n"


REAL_GYM = {
    "gym/__init__.py": "from gym import spaces, error\nclass Env: pass\nclass Wrapper(Env): pass\n",
    "gym/error.py": "class Error(Exception): pass\n",
    "gym/spaces.py": "from gymnasium.spaces import *\n",
}


def test_the_wrapper_is_an_environment_of_the_gym_that_is_installed(tmp_path):
    for name, code in REAL_GYM.items():
        path = tmp_path / "site" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(code)
    code = "import gym\nfrom gym_unity.envs import UnityToGymWrapper as W\nprint(gym.__file__, issubclass(W, gym.Env))"
    assert run(tmp_path, code, [tmp_path / "site"]).split() == [str(tmp_path / "site" / "gym" / "__init__.py"), "True"]
    assert run(tmp_path, code).split()[1] == "True"


PETTINGZOO = """
from mlagents_envs.environment import UnityEnvironment
from mlagents_envs.envs.unity_parallel_env import UnityParallelEnv
from mlagents_envs.envs.unity_aec_env import UnityAECEnv
from mlagents_envs import envs, logging_util
from pettingzoo.test import api_test, parallel_api_test
import warnings

warnings.simplefilter("ignore")
opened = lambda: UnityEnvironment("builtin:Basic", no_graphics=True, additional_args=["--agents", "2"])
env = UnityParallelEnv(opened())
seen, infos = env.reset()
print(sorted(seen), sorted(seen["Basic?team=0?agent_id=0"]), env.action_space(env.agents[0]))
left_and_right = {"Basic?team=0?agent_id=0": 1, "Basic?team=0?agent_id=1": 2}
for _ in range(3):
    seen, rewards, terminations, truncations, infos = env.step(left_and_right)
print([(agent, terminations[agent], round(rewards[agent], 2)) for agent in sorted(terminations)], env.agents)
env.close()
env = envs.Basic.env(no_graphics=True)
env.reset()
total = 0
for agent in env.agent_iter():
    seen, reward, terminated, truncated, info = env.last()
    total += reward
    if terminated:
        break
    env.step(2)
print(agent, round(total, 2))
env.close()
"""


def test_the_pettingzoo_names_play_a_scene(tmp_path):
    pytest.importorskip("pettingzoo")
    first, second, third = run(tmp_path, PETTINGZOO).splitlines()
    assert first == "['Basic?team=0?agent_id=0', 'Basic?team=0?agent_id=1'] ['action_mask', 'observation'] Discrete(3)"
    assert second == (
        "[('Basic?team=0?agent_id=0', True, 0.09), ('Basic?team=0?agent_id=1', False, -0.01), "
        "('Basic?team=0?agent_id=2', False, 0.0)] "
        "['Basic?team=0?agent_id=1', 'Basic?team=0?agent_id=2']"
    )
    assert third == "Basic?team=0?agent_id=0 0.93"
