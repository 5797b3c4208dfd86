"""The player's side, told by hand what a server would say."""

import numpy as np
import pytest

from racecraft.worlds.unity.env.player import Info, ObservationMessage, Player, UnityActionSpec, run_player
from racecraft.worlds.unity.env.side_channels import FLOAT_PROPERTIES, SideChannels
from racecraft.worlds.unity.files import messages


def answer(command=None, status=200, **actions):
    """What a server says: its seed, a command with actions, or goodbye."""
    message = messages.load().UnityMessage()
    message.header.status = status
    if command is None:
        message.unity_input.rl_initialization_input.seed = 41
        return message.SerializeToString()
    order = message.unity_input.rl_input
    order.command = command
    for name, (continuous, discrete) in actions.items():
        order.agent_actions[name].value.add(continuous_actions=continuous, discrete_actions=discrete)
    channels = SideChannels()
    channels.set_float_property("wind", 0.5)
    order.side_channel = channels.take_outgoing() if actions else b""
    return message.SerializeToString()


@pytest.fixture
def live(monkeypatch):
    """Live a player's life among such answers; return its code, what it said and how often it hung up."""

    def lived(player, answers):
        said, ends, waiting = [], [], iter(answers)

        def exchange(data):
            said.append(messages.load().UnityMessage.FromString(data))
            return next(waiting)

        monkeypatch.setattr(
            "racecraft.worlds.unity.env.player.call_as_player", lambda port: (exchange, lambda: ends.append(port))
        )
        return player.live(), said, ends

    return lived


SEEN = [
    ObservationMessage(np.array([1, 2], np.float32), "place", goal=True),
    ObservationMessage(np.zeros((2, 3), np.float32), variable_length=True),
]


def test_a_players_life_goes_from_its_introduction_to_goodbye(live, scenes):
    infos = [
        {"A": [Info(7, SEEN, 0.5, forbidden=[True, False], group_id=3, group_reward=0.25)], "B": []},
        {"A": [Info(7, SEEN, 1.0, done=True, interrupted=True)]},
    ]
    scene = scenes.Recorder({"A": UnityActionSpec(1, (2,)), "B": UnityActionSpec(2)}, infos)
    player = Player(scene, 9, side_channels_to_say=b"once")
    code, said, ends = live(player, [answer(), answer(1), answer(0, A=([0.5], [1])), answer(0, status=400)])
    assert (code, ends, scene.seed, scene.resets) == (0, [9], 41, 1)
    assert scene.told == [{"A": [([0.5], [1])]}]
    assert [payload[-4:] for channel, payload in player.side_channels_heard if channel == FLOAT_PROPERTIES] == [
        np.float32(0.5).tobytes()
    ]
    assert {message.header.status for message in said} == {200}

    hello = said[0].unity_output.rl_initialization_output
    assert (hello.name, hello.package_version, hello.communication_version) == ("AcademySingleton", "3.0.0", "1.5.0")
    assert all(getattr(hello.capabilities, field.name) for field in hello.capabilities.DESCRIPTOR.fields)
    assert not said[1].HasField("unity_output")

    first, second = (message.unity_output for message in said[2:])
    (brain,) = first.rl_initialization_output.brain_parameters
    assert (brain.brain_name, brain.is_training) == ("A", True)
    does = brain.action_spec
    assert (does.num_continuous_actions, does.num_discrete_actions, list(does.discrete_branch_sizes)) == (1, 1, [2])
    assert not second.rl_initialization_output.brain_parameters, "once is enough"
    assert list(first.rl_output.agentInfos) == ["A"], "who has nothing to say is not named"
    assert (first.rl_output.side_channel, second.rl_output.side_channel) == (b"once", b"")
    (one,), (other,) = (output.rl_output.agentInfos["A"].value for output in (first, second))
    assert (one.id, one.reward, one.done, one.max_step_reached, list(one.action_mask)) == (7, 0.5, False, False, [1, 0])
    assert (one.group_id, one.group_reward) == (3, 0.25)
    assert (other.reward, other.done, other.max_step_reached, list(other.action_mask)) == (1.0, True, True, [])


def test_a_broken_connection_ends_a_player_quietly(monkeypatch, scenes):
    def nobody(port):
        raise ConnectionError("nobody listens")

    monkeypatch.setattr("racecraft.worlds.unity.env.player.call_as_player", nobody)
    assert run_player(scenes.Recorder({}, [{}]), 9) == 1
