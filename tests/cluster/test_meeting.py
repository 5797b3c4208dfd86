"""Workers that come by themselves: over real sockets of this machine, in threads of this process."""

import contextlib
import json
import pickle
import stat
import threading
import time
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client

import pytest
import torch
from tests.cluster.test_spread_training import assert_same, cart
from tests.cluster.workers_here import spread_here

from racecraft.cluster.asked import ClusterAsked
from racecraft.cluster.meeting import MEETING, MeetingTransport, attend
from racecraft.cluster.messages import Surroundings
from racecraft.cluster.spreading import spread_by
from racecraft.cluster.transport import ClusterError
from racecraft.cluster.worker import Worker
from racecraft.training.callbacks import Silent
from racecraft.training.worlds import train

LONG = 120.0


@pytest.fixture(autouse=True)
def _threads_as_before():
    threads = torch.get_num_threads()
    yield
    torch.set_num_threads(threads)


def beside(act, *arguments):
    """Begin something in a thread; return it, and where its result will be."""
    results = []
    thread = threading.Thread(target=lambda: results.append(act(*arguments)), daemon=True)
    thread.start()
    return thread, results


def spread_at(place):
    return spread_by(lambda: MeetingTransport(place, LONG), ClusterAsked(None, "secondary"))


def test_two_who_come_give_the_curve_of_two_who_were_begun(tmp_path):
    here, there, place = tmp_path / "here", tmp_path / "there", tmp_path / "place"
    train(cart(here), Silent(), lambda text: None, spread_here(2)[0])
    comers = [beside(attend, place, "secondary", 2, LONG) for _ in range(2)]  # before there is a meeting
    said = []
    train(cart(there), Silent(), said.append, spread_at(place))
    for thread, answered in comers:
        thread.join(60)
        assert answered[0] >= 6
    assert "- cluster secondary: 2 workers on 1 machine, the learner here" in said
    assert not (place / MEETING).exists()
    assert_same(here, there)


def attend_and_leave(place, questions):
    """Come, answer some questions, and be gone without a word."""
    told = json.loads((place / MEETING).read_text())
    with Client(tuple(told["address"]), authkey=bytes.fromhex(told["key"])) as door:
        door.send_bytes(json.dumps(["secondary", 1]).encode())
        worker = Worker(Surroundings((), "."))
        for _ in range(questions):
            ticket, what, message = pickle.loads(door.recv_bytes())
            door.send_bytes(pickle.dumps((ticket, pickle.dumps(getattr(worker, what)(message)))))
        door.recv_bytes()


def test_another_goes_on_where_one_that_is_gone_had_stood(tmp_path):
    here, there, place = tmp_path / "here", tmp_path / "there", tmp_path / "place"
    train(cart(here), Silent(), lambda text: None, spread_here(1)[0])
    said, met = [], threading.Event()

    def wild():
        assert met.wait(LONG)
        attend_and_leave(place, questions=6)  # come, open, begin and three collectings
        return attend(place, "another", 1, LONG)

    thread, answered = beside(wild)

    def say(text):
        said.append(text)

    def reach():
        threading.Thread(target=wait_for_the_file, args=(place, met), daemon=True).start()
        return MeetingTransport(place, LONG)

    train(cart(there), Silent(), say, spread_by(reach, ClusterAsked(None, "secondary")))
    thread.join(60)
    assert answered
    assert any("worker 0 was lost (its process ended)" in text for text in said)
    assert_same(here, there)


def wait_for_the_file(place, met):
    while not (place / MEETING).exists():
        time.sleep(0.01)
    met.set()


def test_who_waits_for_nobody_is_told(tmp_path):
    with pytest.raises(ClusterError, match="0 workers came within 0 s; expected a secondary job with the same s3_buck"):
        MeetingTransport(tmp_path / "place", 0.05)
    assert not (tmp_path / "place" / MEETING).exists()
    with pytest.raises(ClusterError, match="nobody to carry worlds for came within 0 s; expected a primary job"):
        attend(tmp_path / "place", "secondary", 1, 0.05)


def test_half_a_party_is_no_party_and_who_has_not_the_key_is_not_heard(tmp_path):
    place, heard = tmp_path / "place", []

    def come():
        told = json.loads((place / MEETING).read_text())
        heard.append(stat.S_IMODE(place.stat().st_mode))
        with contextlib.suppress(AuthenticationError, OSError, EOFError):
            Client(tuple(told["address"]), authkey=b"no key of theirs")
            heard.append("let in")
        doors = []
        for party, of in (("half", 2), ("whole", 1)):
            doors.append(Client(tuple(told["address"]), authkey=bytes.fromhex(told["key"])))
            doors[-1].send_bytes(json.dumps([party, of]).encode())
        heard.extend(pickle.loads(door.recv_bytes()) for door in doors)
        for door in doors:
            door.close()

    met = threading.Event()
    threading.Thread(target=wait_for_the_file, args=(place, met), daemon=True).start()
    thread, _ = beside(lambda: met.wait(LONG) and come())
    transport = MeetingTransport(place, LONG)
    assert transport.room == 1
    assert [comer.name for comer in transport._comers] == ["half", "whole"]
    transport.close()
    thread.join(60)
    assert heard == [0o700, None, None], "both are told that all is over"


def test_a_meeting_of_yesterday_keeps_nobody(tmp_path):
    """Its leader was killed; whoever comes waits for the next."""
    place = tmp_path / "place"
    place.mkdir()
    (place / MEETING).write_text(json.dumps({"address": ["127.0.0.1", 9], "key": "00"}))
    thread, answered = beside(attend, place, "secondary", 1, LONG)
    transport = MeetingTransport(place, LONG)
    ticket = transport.ask(transport.start(), "come", None)
    while not transport.answered([ticket], 1.0):
        pass
    assert transport.answer(ticket) is None
    transport.close()
    transport.close()
    thread.join(60)
    assert answered == [1]
