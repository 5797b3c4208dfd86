"""The player's side, told by hand what a server would say."""

import numpy as np
import pytest

from racecraft.worlds.unity.env.player import (
    Info,
    ObservationMessage,
    Player,
    UnityActionSpec,
    mapping_of,
    pngs,
    run_player,
)
from racecraft.worlds.unity.env.side_channels import FLOAT_PROPERTIES, SideChannels
from racecraft.worlds.unity.files import messages
from racecraft.worlds.unity.files.pictures import decode_picture


@pytest.mark.parametrize(
    ("channels", "mapping"),
    [
        (1, [0, 0, 0]),
        (2, [0, 1, -1]),
        (3, [0, 1, 2]),
        (4, [0, 1, 2, 3, -1, -1]),
        (5, [0, 1, 2, 3, 4, -1]),
        (6, [0, 1, 2, 3, 4, 5]),
    ],
)
def test_channels_are_filled_up_to_threes_and_grey_is_sent_thrice(channels, mapping):
    """Read again without a mapping: what fills up is black."""
    picture = np.random.default_rng(1).integers(0, 256, (2, 3, channels), np.uint8)
    assert list(mapping_of(channels)) == mapping
    sent = decode_picture(pngs(picture), (2, 3, len(mapping)), ())
    for place, target in enumerate(mapping):
        np.testing.assert_array_equal(sent[:, :, place], 0 if target < 0 else picture[:, :, target])
    assert pngs(picture).count(b"IEND") == len(mapping) // 3


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


def test_a_player_that_is_told_goodbye_at_once_begins_nothing(live, scenes):
    scene = scenes.Recorder({"A": UnityActionSpec(1)}, [{}])
    code, said, ends = live(Player(scene, 9), [answer(status=400)])
    assert (code, len(said), ends, scene.seed) == (0, 1, [9], None)


def test_a_broken_connection_ends_a_player_quietly(monkeypatch, scenes):
    def nobody(port):
        raise ConnectionError("nobody listens")

    monkeypatch.setattr("racecraft.worlds.unity.env.player.call_as_player", nobody)
    assert run_player(scenes.Recorder({}, [{}]), 9) == 1


@pytest.mark.parametrize(
    ("version", "shape", "wire"),
    [
        ("3.0.0", (2, 3, 4), (4, 2, 3)),
        ("2.3.0", (2, 3, 4), (2, 3, 4)),
        ("3.0.0", (2, 3), (2, 3)),
        ("3.0.0", (2,), (2,)),
    ],
)
def test_what_is_seen_travels_with_its_shape_and_its_marks(live, scenes, version, shape, wire):
    values = np.arange(np.prod(shape), dtype=np.float32).reshape(shape)
    seen = [ObservationMessage(values, "plain"), ObservationMessage(values, variable_length=True, goal=True)]
    if len(shape) == 3:
        seen.append(ObservationMessage(values.astype(np.uint8)))
    scene = scenes.Recorder({"A": UnityActionSpec(1)}, [{"A": [Info(0, seen)]}])
    _, said, _ = live(Player(scene, 9, version), [answer(), answer(1), answer(0, status=400)])
    plain, marked, *pictures = said[-1].unity_output.rl_output.agentInfos["A"].value[0].observations
    sent = np.moveaxis(values, 2, 0) if wire != shape else values
    for one in (plain, marked):
        assert (tuple(one.shape), list(one.float_data.data), one.compression_type) == (wire, sent.ravel().tolist(), 0)
    assert (plain.name, plain.observation_type, list(plain.dimension_properties)) == ("plain", 0, [1] * len(shape))
    assert (marked.name, marked.observation_type) == ("", 1)
    assert list(marked.dimension_properties) == [4, *[1] * (len(shape) - 1)]
    for picture in pictures:
        assert (tuple(picture.shape), picture.compression_type) == (wire, 1)
        assert list(picture.compressed_channel_mapping) == [0, 1, 2, 3, -1, -1]
        np.testing.assert_array_equal(decode_picture(picture.compressed_data, shape, ()), values)


def test_who_says_nothing_more_has_nothing_more():
    assert Info(1, []) == Info(1, [], 0.0, False, False, (), 0, 0.0)
    assert (ObservationMessage(SEEN).variable_length, ObservationMessage(SEEN).goal, UnityActionSpec()) == (
        False,
        False,
        UnityActionSpec(0, ()),
    )
