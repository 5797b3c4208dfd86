"""Push: newest two for a slow page, nothing made while nobody listens, the server's end ends the stream."""

import asyncio
import http.client
import json
import time
from contextlib import ExitStack, closing, contextmanager

from starlette.routing import Route

from racecraft.web.push import KEPT, Topic, events_answer


def stream_of(topics):
    async def events(request):
        return events_answer(request, topics)

    return [Route("/events", events)]


@contextmanager
def listen(client, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", client.port, timeout=60)
    connection.request("GET", "/events", headers={name.replace("_", "-"): value for name, value in headers.items()})
    with closing(connection):
        yield connection.getresponse()


def messages(answer, count):
    found = []
    while len(found) < count:
        line = answer.readline()
        assert line, "the stream ended"
        if line.startswith(b"data: "):
            found.append(json.loads(line[6:]))
    return found


def test_a_slow_page_gets_the_newest():
    async def fall_behind():
        topic, event = Topic("laps"), asyncio.Event()
        waiting = topic.join(event, "")
        for k in range(10):
            topic._put(str(k))
        return [one.split(b"data: ")[1].strip() for one in waiting]

    assert asyncio.run(fall_behind()) == [b"8", b"9"]
    assert KEPT == 2


def test_messages_come_and_a_page_that_returns_gets_what_it_missed(served):
    topic = Topic("laps")
    topic.publish({"lap": 1})
    with served(stream_of([topic])) as client:
        with listen(client) as first:
            assert messages(first, 1) == [{"lap": 1}]
            topic.publish({"lap": 2, "loss": float("nan")})
            assert messages(first, 1) == [{"lap": 2, "loss": None}]
        with listen(client, Last_Event_ID="laps 1") as again:
            assert messages(again, 1) == [{"lap": 2, "loss": None}]


def test_nothing_is_made_while_nobody_listens(served):
    asked = []
    topic = Topic("load", lambda: asked.append(1) or {"n": len(asked)}, 0.02)
    with served(stream_of([topic])) as client:
        time.sleep(0.1)
        assert asked == []
        with listen(client) as answer:
            assert messages(answer, 2) == [{"n": 1}, {"n": 2}]
        end = time.monotonic() + 60
        before = -1
        while before != len(asked):
            assert time.monotonic() < end
            before = len(asked)
            time.sleep(0.15)


def test_the_end_of_the_server_ends_the_stream(served):
    with ExitStack() as kept:
        with served(stream_of([Topic("laps")])) as client:
            answer = kept.enter_context(listen(client))
            answer.readline()
            began = time.monotonic()
        assert answer.read() in (b"", b"\n")
        assert time.monotonic() - began < 20
