"""Beside the originals: ML-Agents' own client against our stand-in, and a real build, where somebody has them.

RACECRAFT_OFFICIAL_MLAGENTS_PYTHON   an interpreter with mlagents-envs (0.28.0 with protobuf 3.20.3, say)
RACECRAFT_UNITY_BUILD                whatever `find_build` understands
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import racecraft
from racecraft.contract.world import allocate
from racecraft.worlds.unity.env.side_channels import Gaussian, MultiRange, SideChannels, Uniform, split
from racecraft.worlds.unity.env.world import UnityWorld
from racecraft.worlds.unity.files.messages import FIELDS

OFFICIAL = os.environ.get("RACECRAFT_OFFICIAL_MLAGENTS_PYTHON")
needs_official = pytest.mark.skipif(
    not OFFICIAL, reason="RACECRAFT_OFFICIAL_MLAGENTS_PYTHON names no interpreter with mlagents-envs"
)
BUILD = os.environ.get("RACECRAFT_UNITY_BUILD")


def official(code, *arguments):
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    ran = subprocess.run(
        [OFFICIAL, "-c", code, *map(str, arguments)], capture_output=True, text=True, timeout=120, env=clean
    )
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout.splitlines()[-1])


@pytest.fixture
def executable(tmp_path):
    """The stand-in as a file, as the official client wants it."""
    path = tmp_path / "Basic.x86_64"
    home = Path(racecraft.__file__).parent.parent
    path.write_text(
        f'#!/bin/sh\nPYTHONPATH="{home}" exec "{sys.executable}" -P -m racecraft.worlds.unity.env.basic_scene "$@"\n'
    )
    path.chmod(0o755)
    return path


DRIVE = """
import json, sys, time
import numpy as np
from mlagents_envs.environment import UnityEnvironment
from mlagents_envs.base_env import ActionTuple
from mlagents_envs.side_channel.engine_configuration_channel import EngineConfigurationChannel

engine = EngineConfigurationChannel()
env = UnityEnvironment(sys.argv[1], no_graphics=True, worker_id=int(sys.argv[2]), side_channels=[engine])
engine.set_configuration_parameters(time_scale=20.0)
env.reset()
(name,) = env.behavior_specs
spec = env.behavior_specs[name]
right, earned, steps = ActionTuple(discrete=np.array([[2]])), 0.0, 0
while True:
    env.set_actions(name, right)
    env.step()
    decisions, ended = env.get_steps(name)
    steps += 1
    if len(ended):
        earned += float(ended.reward[0])
        break
    earned += float(decisions.reward[0])
begun, count = time.time(), 0
while time.time() - begun < 1.0:
    env.set_actions(name, right)
    env.step()
    count += 1
rate = count / (time.time() - begun)
env.close()
shape, branches = list(spec.observation_specs[0].shape), list(spec.action_spec.discrete_branches)
print(json.dumps([name, shape, branches, earned, steps, rate]))
"""


@needs_official
def test_the_official_client_drives_our_stand_in(executable):
    name, shape, branches, earned, steps, rate = official(DRIVE, executable, os.getpid() % 500)
    assert (name, shape, branches) == ("Basic?team=0", [20], [3])
    assert earned == pytest.approx(0.93)
    assert steps == 7
    print(f"official client: {rate:.0f} exchanges/s")


DESCRIBE = """
import json
from mlagents_envs.communicator_objects import (
    agent_action_pb2, agent_info_action_pair_pb2, agent_info_pb2, brain_parameters_pb2, capabilities_pb2,
    demonstration_meta_pb2, header_pb2, observation_pb2, unity_input_pb2, unity_message_pb2, unity_output_pb2,
    unity_rl_initialization_input_pb2, unity_rl_initialization_output_pb2, unity_rl_input_pb2, unity_rl_output_pb2,
)

TYPES = {1: "double", 2: "float", 3: "int64", 5: "int32", 8: "bool", 9: "string", 12: "bytes", 14: "int32"}
told = {}


def walk(message):
    for field in message.fields:
        kind = field.message_type.name if field.message_type else TYPES[field.type]
        if field.message_type and field.message_type.GetOptions().map_entry:
            kind = "{}" + field.message_type.fields_by_name["value"].message_type.name
        elif field.label == 3:
            kind = "*" + kind
        if field.containing_oneof is not None:
            kind += "/" + field.containing_oneof.name
        told.setdefault(message.name, {})[field.name] = [field.number, kind]
    for nested in message.nested_types:
        if not nested.GetOptions().map_entry:
            walk(nested)


for module in list(globals().values()):
    if hasattr(module, "DESCRIPTOR"):
        for message in module.DESCRIPTOR.message_types_by_name.values():
            walk(message)
print(json.dumps(told))
"""


@needs_official
def test_our_field_table_is_the_official_one():
    theirs = official(DESCRIBE)
    for message, fields in FIELDS.items():
        for word in fields.split():
            number, name, kind = word.split(":")
            assert theirs[message][name] == [int(number), kind], f"{message}.{name}"


CHANNELS = """
import json
from mlagents_envs.side_channel.engine_configuration_channel import EngineConfigurationChannel
from mlagents_envs.side_channel.environment_parameters_channel import EnvironmentParametersChannel
from mlagents_envs.side_channel.float_properties_channel import FloatPropertiesChannel
from mlagents_envs.side_channel.side_channel_manager import SideChannelManager

engine, parameters, floats = EngineConfigurationChannel(), EnvironmentParametersChannel(), FloatPropertiesChannel()
manager = SideChannelManager([engine, parameters, floats])
engine.set_configuration_parameters(84, 48, 5, 20.0, -1, 60)
parameters.set_float_parameter("mass", 0.5)
parameters.set_uniform_sampler_parameters("wind", 1.0, 2.0, 9)
parameters.set_gaussian_sampler_parameters("size", 1.0, 2.0, 9)
parameters.set_multirangeuniform_sampler_parameters("gap", [(1.0, 2.0), (5.0, 6.0)], 9)
floats.set_property("gravity", -9.81)
print(json.dumps(manager.generate_side_channel_messages().hex()))
"""


@needs_official
def test_our_side_channel_bytes_are_the_official_ones():
    channels = SideChannels()
    channels.set_engine(
        width=84, height=48, quality_level=5, time_scale=20.0, target_frame_rate=-1, capture_frame_rate=60
    )
    channels.set_parameter("mass", 0.5)
    channels.set_parameter("wind", Uniform(1.0, 2.0), seed=9)
    channels.set_parameter("size", Gaussian(1.0, 2.0), seed=9)
    channels.set_parameter("gap", MultiRange(((1.0, 2.0), (5.0, 6.0))), seed=9)
    channels.set_float_property("gravity", -9.81)
    theirs = split(bytes.fromhex(official(CHANNELS)))
    assert sorted(split(channels.take_outgoing()), key=repr) == sorted(theirs, key=repr)


@pytest.mark.skipif(not BUILD, reason="RACECRAFT_UNITY_BUILD names no build")
def test_a_real_build_can_be_played():
    world = UnityWorld(BUILD, behavior=os.environ.get("RACECRAFT_UNITY_BEHAVIOR"))
    buffers = allocate(world.spec)
    rng = np.random.default_rng(0)
    world.reset(buffers, 0)
    for _ in range(100):
        shape = (world.spec.num_worlds, world.spec.num_agents)
        if buffers.action_mask is not None:
            actions = np.where(buffers.action_mask, rng.random(buffers.action_mask.shape), -1).argmax(-1)
        else:
            actions = rng.uniform(-1, 1, (*shape, *world.spec.actions.shape)).astype(np.float32)
        world.step(actions, buffers)
    world.close()
