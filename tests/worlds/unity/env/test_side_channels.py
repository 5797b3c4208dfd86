"""Side channels: the bytes, by hand, and what arrives."""

import struct
import uuid

import numpy as np
import pytest

from racecraft.worlds.unity.env.errors import WireError
from racecraft.worlds.unity.env.player import Player
from racecraft.worlds.unity.env.session import Choice
from racecraft.worlds.unity.env.side_channels import (
    ENVIRONMENT_PARAMETERS,
    FLOAT_PROPERTIES,
    STATISTICS,
    Gaussian,
    MultiRange,
    Reader,
    SideChannels,
    Statistic,
    Uniform,
    pack_floats,
    pack_string,
    split,
)


def test_a_record_is_the_id_in_dotnet_order_the_length_and_the_payload():
    channels = SideChannels()
    channels.send(uuid.UUID("00010203-0405-0607-0809-0a0b0c0d0e0f"), b"ab")
    assert channels.take_outgoing().hex() == "030201000504070608090a0b0c0d0e0f" + "02000000" + "6162"
    assert channels.take_outgoing() == b""


def test_engine_settings_are_kind_and_value():
    channels = SideChannels()
    channels.set_engine(
        width=84, height=48, quality_level=5, time_scale=20, target_frame_rate=-1, capture_frame_rate=60
    )
    payloads = [payload for _, payload in split(channels.take_outgoing())]
    assert payloads == [
        struct.pack("<iii", 0, 84, 48),
        struct.pack("<ii", 1, 5),
        struct.pack("<if", 2, 20.0),
        struct.pack("<ii", 3, -1),
        struct.pack("<ii", 4, 60),
    ]
    with pytest.raises(ValueError, match="together"):
        channels.set_engine(width=84)


@pytest.mark.parametrize(
    ("value", "tail"),
    [
        (0.5, struct.pack("<if", 0, 0.5)),
        (Uniform(1, 2), struct.pack("<iiiff", 1, 9, 0, 1, 2)),
        (Gaussian(1, 2), struct.pack("<iiiff", 1, 9, 1, 1, 2)),
        (MultiRange(((1, 2), (5, 6))), struct.pack("<iiiiffff", 1, 9, 2, 4, 1, 2, 5, 6)),
    ],
)
def test_parameters_are_numbers_or_samplers(value, tail):
    channels = SideChannels()
    channels.set_parameter("mass", value, seed=9)
    assert split(channels.take_outgoing()) == [(ENVIRONMENT_PARAMETERS, pack_string("mass") + tail)]


def test_what_is_packed_is_read_again():
    reader = Reader(pack_string("abc") + pack_floats([1.5, -2.0]) + b"\1" + struct.pack("<if", -7, 0.25))
    assert reader.read_string() == "abc"
    assert reader.read_floats() == [1.5, -2.0]
    assert reader.read_bool() is True
    assert (reader.read_int(), reader.read_float()) == (-7, 0.25)
    with pytest.raises(WireError, match="cut or lies"):
        reader.read_int()


def test_strings_are_ascii():
    with pytest.raises(ValueError, match="ASCII"):
        pack_string("größe")


def record(channel, payload):
    return channel.bytes_le + struct.pack("<i", len(payload)) + payload


def test_statistics_properties_and_strangers_are_sorted_in():
    channels, heard = SideChannels(), []
    ours, theirs = uuid.uuid4(), uuid.uuid4()
    channels.listen(ours, heard.append)
    channels.receive(
        record(STATISTICS, pack_string("score") + struct.pack("<fi", 2.5, 2))
        + record(FLOAT_PROPERTIES, pack_string("speed") + struct.pack("<f", 3.0))
        + record(ours, b"hello")
        + record(theirs, b"who?")
    )
    assert channels.take_statistics() == [Statistic("score", 2.5, "sum")]
    assert channels.take_statistics() == []
    assert channels.float_properties == {"speed": 3.0}
    assert heard == [b"hello"]
    assert channels.raw == [(theirs, b"who?")]


@pytest.mark.parametrize(("kind", "name"), [*enumerate(["average", "most_recent", "sum", "histogram"])])
def test_aggregations_are_numbered_as_in_unity(kind, name):
    channels = SideChannels()
    channels.receive(record(STATISTICS, pack_string("score") + struct.pack("<fi", 2.5, kind)))
    assert channels.take_statistics() == [Statistic("score", 2.5, name)]


@pytest.mark.parametrize("kind", [-1, 4])
def test_aggregations_that_unity_does_not_have_are_named(kind):
    with pytest.raises(WireError, match=f"aggregation {kind}; expected 0 to 3"):
        SideChannels().receive(record(STATISTICS, pack_string("score") + struct.pack("<fi", 2.5, kind)))


def test_strangers_are_kept_within_bounds():
    channels = SideChannels()
    channels.receive(record(uuid.uuid4(), b"") * 1500)
    assert len(channels.raw) == 1000


@pytest.mark.parametrize("cut", range(1, 40, 6))
def test_cut_bytes_are_named_errors(cut):
    data = record(STATISTICS, pack_string("score") + struct.pack("<fi", 2.5, 2))
    with pytest.raises(WireError):
        SideChannels().receive(data[: len(data) - cut] if cut < len(data) else data[:1])


def test_messages_ride_with_the_next_answer_and_back(talk, scenes):
    class Chatty(Player):
        side_channels_to_say = record(FLOAT_PROPERTIES, pack_string("wind") + struct.pack("<f", 0.5))

    channels = SideChannels()
    channels.set_engine(time_scale=3.0)
    session = talk(scenes.BasicScene(), player=Chatty, claims={"side_channels_to_say": Chatty.side_channels_to_say},
                   channels=channels)  # fmt: skip
    session.reset()
    session.channels.set_float_property("gravity", -9.81)
    session.step({"Basic?team=0": Choice(discrete=[[0]])})
    heard = session.player.side_channels_heard
    assert heard[0][1] == struct.pack("<if", 2, 3.0)
    assert heard[1] == (FLOAT_PROPERTIES, pack_string("gravity") + np.float32(-9.81).tobytes())
    assert session.channels.float_properties == {"wind": 0.5}
