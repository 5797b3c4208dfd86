"""The server: loopback only, ports, big messages, one call at a time, and nothing that waits for ever."""

import socket
import subprocess
import sys
import threading
import time

import pytest

from racecraft.worlds.unity.env.errors import PlayerDiedError, PortTakenError, SessionClosedError, UnityError, WireError
from racecraft.worlds.unity.env.wire import Wire, call_as_player
from racecraft.worlds.unity.files.messages import load


@pytest.fixture
def wire():
    wire = Wire()
    yield wire
    wire.close(patience_seconds=0)


def in_background(work):
    result = []

    def run():
        try:
            result.append(work())
        except Exception as error:
            result.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread, result


def test_a_call_is_heard_and_its_answer_arrives(wire):
    exchange, disconnect = call_as_player(wire.port)
    thread, got = in_background(lambda: exchange(b"question"))
    assert wire.receive(5) == b"question"
    wire.answer(b"reply")
    thread.join(60)
    assert got == [b"reply"]
    disconnect()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux answers on all of 127.0.0.0/8")
def test_the_server_listens_on_loopback_only(wire):
    """A server on every interface would answer on 127.0.0.2 too."""
    with socket.socket() as stranger:
        assert stranger.connect_ex(("127.0.0.2", wire.port)) != 0
    with socket.socket() as friend:
        assert friend.connect_ex(("127.0.0.1", wire.port)) == 0


def test_a_taken_port_is_named(wire):
    with pytest.raises(PortTakenError, match=f"{wire.port}"):
        Wire(wire.port)
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(PortTakenError, match="in use"):
            Wire(port)


def test_a_port_can_be_used_again_at_once():
    wire = Wire()
    port = wire.port
    wire.close(patience_seconds=0)
    again = Wire(port)
    assert again.port == port
    again.close(patience_seconds=0)


def test_eight_megabytes_pass(wire):
    """gRPC alone would refuse more than four."""
    exchange, disconnect = call_as_player(wire.port)
    data = bytes(8 * 2**20)
    thread, _ = in_background(lambda: exchange(data))
    assert wire.receive(10) == data
    wire.answer(b"")
    thread.join(60)
    disconnect()


def test_a_message_larger_than_the_limit_is_a_named_error():
    wire = Wire(max_message_bytes=1000)
    exchange, disconnect = call_as_player(wire.port)
    thread, got = in_background(lambda: exchange(bytes(5000)))
    with pytest.raises(WireError, match="1,000 bytes"):
        wire.receive(5)
    thread.join(60)
    assert isinstance(got[0], ConnectionError)
    disconnect()
    wire.close(patience_seconds=0)


def test_bytes_that_are_no_grpc_do_not_disturb(wire):
    with socket.socket() as stranger:
        stranger.connect(("127.0.0.1", wire.port))
        stranger.sendall(b"GET / HTTP/1.1\r\n\r\n" + bytes(range(256)) * 10)
        exchange, disconnect = call_as_player(wire.port)
        thread, got = in_background(lambda: exchange(b"hello"))
        assert wire.receive(5) == b"hello"
        wire.answer(b"well")
        thread.join(60)
        assert got == [b"well"]
        disconnect()


def test_two_calls_at_once_are_refused(wire):
    exchange, disconnect = call_as_player(wire.port)
    in_background(lambda: exchange(b"one"))
    assert wire.receive(5) == b"one"
    thread, got = in_background(lambda: exchange(b"two"))
    with pytest.raises(WireError, match="twice"):
        wire.receive(5)
    thread.join(60)
    assert isinstance(got[0], ConnectionError)
    disconnect()


def test_a_stranger_who_calls_the_port_is_turned_away_and_the_player_goes_on(wire, caplog):
    """Once while the player's call is pending, once while the player works on our answer."""
    exchange, disconnect = call_as_player(wire.port)
    stranger, leave = call_as_player(wire.port)
    thread, got = in_background(lambda: exchange(b"one"))
    assert wire.receive(5) == b"one"
    with pytest.raises(ConnectionError, match="belongs to another player"):
        stranger(b"me too")
    wire.answer(b"first")
    thread.join(60)
    with pytest.raises(ConnectionError, match="belongs to another player"):
        stranger(b"and now")
    thread, got_again = in_background(lambda: exchange(b"two"))
    assert wire.receive(5) == b"two"
    wire.answer(b"second")
    thread.join(60)
    assert (got, got_again) == ([b"first"], [b"second"])
    assert "turned away" in caplog.text
    disconnect()
    leave()


class Caller:
    """What gRPC tells of a call, for two that race."""

    def __init__(self, peer):
        self.peer = lambda: peer

    def abort(self, code, why):
        raise ConnectionError(why)

    def add_callback(self, call):
        return True


def test_of_two_first_callers_the_one_whose_message_arrives_first_is_the_player(wire):
    def slow():
        in_background(lambda: wire._exchange(iter([b"player"]), Caller("a")))
        assert wire.receive(5) == b"player"
        yield b"stranger"

    with pytest.raises(ConnectionError, match="belongs to another player"):
        wire._exchange(slow(), Caller("b"))
    wire.answer(b"well")


def test_hanging_up_is_noticed_long_before_patience_ends(wire):
    exchange, disconnect = call_as_player(wire.port)
    thread, _ = in_background(lambda: exchange(b"one"))
    assert wire.receive(5) == b"one"
    begun = time.monotonic()
    disconnect()
    with pytest.raises(PlayerDiedError, match="hung up"):
        wire.receive(60)
    assert time.monotonic() - begun < 30
    thread.join(60)


def test_silence_returns_none_after_the_time_given(wire):
    begun = time.monotonic()
    assert wire.receive(0.3) is None
    assert 0.25 < time.monotonic() - begun < 30


def test_who_looks_after_the_player_is_asked_while_waiting(wire):
    def look():
        raise UnityError("it is dead")

    begun = time.monotonic()
    with pytest.raises(UnityError, match="dead"):
        wire.receive(60, look)
    assert time.monotonic() - begun < 30


def test_closing_answers_the_pending_call_and_twice_is_once(wire):
    exchange, disconnect = call_as_player(wire.port)
    thread, got = in_background(lambda: exchange(b"one"))
    assert wire.receive(5) == b"one"
    wire.close(b"goodbye")
    wire.close(b"goodbye")
    thread.join(60)
    assert got == [b"goodbye"]
    with pytest.raises(SessionClosedError):
        wire.receive(1)
    with pytest.raises(SessionClosedError):
        wire.answer(b"")
    disconnect()


def test_no_thread_is_left_behind():
    before = set(threading.enumerate())
    for _ in range(20):
        wire = Wire()
        exchange, disconnect = call_as_player(wire.port)
        thread, _ = in_background(lambda exchange=exchange: exchange(b"one"))
        wire.receive(5)
        wire.close(b"bye")
        thread.join(60)
        disconnect()
    time.sleep(0.2)
    assert set(threading.enumerate()) - before == set()


FORGETFUL = """
from racecraft.worlds.unity.env.session import Session
session = Session("builtin:Basic")
session.reset()
print(session.pid, flush=True)
"""


def test_an_interpreter_that_forgets_to_close_still_ends():
    """The thread that holds the pending call must not keep it alive (the official client's hung for ten minutes)."""
    ended = subprocess.run([sys.executable, "-c", FORGETFUL], capture_output=True, text=True, timeout=60)
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr == ""


def test_fields_have_the_numbers_of_the_protocol():
    """By hand: field 2 (0x12) of the message holds field 2 (0x12) of the output, whose name is field 1 (0x0a)."""
    message = load().UnityMessage()
    message.unity_output.rl_initialization_output.name = "A"
    assert message.SerializeToString() == bytes([0x12, 5, 0x12, 3, 0x0A, 1, 0x41])
    info = load().AgentInfo(reward=1.0, done=True, id=3, action_mask=[True, False], group_id=2)
    # 7 float, 8 varint, 10 varint, 11 packed bools, 14 varint
    assert info.SerializeToString().hex() == "3d0000803f" + "4001" + "5003" + "5a020100" + "7002"
    seen = load().Observation(shape=[2], name="n", observation_type=1)
    seen.float_data.data.extend([1.0, -1.0])
    # 1 packed, 4 message of packed floats (upb writes fields in order of number), 7, 8
    assert seen.SerializeToString().hex() == "0a0102" + "220a0a080000803f000080bf" + "3801" + "42016e"


def test_a_question_is_answered_once(wire):
    exchange, disconnect = call_as_player(wire.port)
    thread, got = in_background(lambda: exchange(b"question"))
    assert wire.receive(60) == b"question"
    wire.answer(b"reply")
    with pytest.raises(WireError, match="nothing was asked"):
        wire.answer(b"again")
    thread.join(60)
    assert got == [b"reply"]
    disconnect()


def test_closing_without_a_goodbye_cuts_the_call():
    wire = Wire()
    exchange, disconnect = call_as_player(wire.port)
    thread, got = in_background(lambda: exchange(b"question"))
    assert wire.receive(60) == b"question"
    wire.close()
    thread.join(60)
    assert isinstance(got[0], ConnectionError)
    disconnect()
