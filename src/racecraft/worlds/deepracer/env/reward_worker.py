"""The process in which a racer's reward function lives: it loads the file, then pays all cars of a tick a message.

    {"load": …}                        gives up its rights, loads the file     → {"layers": […], "line": 12}
    {"copies": 32}                     loads a copy for each car               → {}
    {"variant": {…}}                   loads another source beside the file    → {}
    {"course": {…}}, waypoints         keeps what stays the same on a track    → {}
    {"tick": [course, group, rows]},   pays the cars of these rows             → rewards, float64 (rows,)
        cars, reports, objects
    {"call": {…}}, waypoints           pays for one dictionary                 → reward, float64 (1,)

Any answer may also hold "printed", what the function printed; "error", why it failed, after as many rewards as went
before; with {"trace": 1}, "traces" and "lines" (`reward_trace.py`). While an answer takes long,
{"alive": k} tells after which car.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TextIO, cast

import numpy as np

from racecraft.contract.errors import RewardError, RewardFileError
from racecraft.contract.world import Array
from racecraft.isolation.channel import Channel, from_head, to_head
from racecraft.isolation.layers import restrict
from racecraft.isolation.process import ALIVE_SHARE
from racecraft.isolation.worker import Printed, run_worker
from racecraft.worlds.deepracer.env.reward_params import CentreLine, ObjectReports, RewardParams
from racecraft.worlds.deepracer.files.reward_examples import Params
from racecraft.worlds.deepracer.files.reward_file import RewardFunction, load_reward_function
from racecraft.worlds.deepracer.files.reward_source import source_of
from racecraft.worlds.deepracer.files.reward_trace import RewardTrace

_INT, _FLOAT = np.dtype(np.int64), np.dtype(np.float64)


def main() -> None:
    """Answer until the owner closes the pipe."""
    run_worker(lambda channel, printed: Worker(channel, printed).answer)


class Worker:
    """A reward function, its copies, and the courses they are asked about."""

    def __init__(self, channel: Channel, printed: Printed) -> None:
        self._channel, self._printed = channel, printed
        self._reward: RewardFunction
        self._groups: list[list[RewardFunction]] = []
        self._courses: list[Course] = []
        self._alive_seconds, self._alive = 0.0, 0.0

    def answer(self, head: bytes, body: bytes) -> None:
        """Do what a message asks, and send the answer."""
        request = from_head(head)
        self._alive = time.monotonic()
        reply: dict[str, Any] = {}
        paid: list[float] = []
        try:
            if "tick" in request:
                course, group, rows = request["tick"]
                self._pay(self._courses[course].rows(body, rows), self._groups[group], paid, reply, "trace" in request)
            elif "call" in request:
                paid.append(self._reward.call(_with_waypoints(request["call"], body)))
            elif "course" in request:
                self._courses.append(Course(request["course"], body))
            elif "copies" in request:
                self._groups.append(self._copies(request["copies"]))
            elif "variant" in request:
                other = request["variant"]
                source = source_of(other["path"], other["text"], other["modules"])
                self._groups.append([load_reward_function(source, cast(TextIO, self._printed), is_restricted=True)])
            elif "load" in request:
                reply = self._load(request["load"])
        except RewardError as error:
            reply["error"] = str(error)
        except RewardFileError as error:
            reply["file_error"] = [str(error.found), str(error.expected), str(error.hint), error.line, error.key]
        if printed := self._printed.pop():
            reply["printed"] = printed
        self._channel.send(to_head(reply) if reply else b"", np.array(paid).tobytes())

    def _load(self, request: Mapping[str, Any]) -> dict[str, Any]:
        self._alive_seconds = ALIVE_SHARE * request["seconds"]
        layers: tuple[str, ...] = ()
        if request["readable"] is not None:
            layers = restrict(request["readable"], request["memory_bytes"])
        source = source_of(request["path"], request["text"], request["modules"])
        self._reward = load_reward_function(source, cast(TextIO, self._printed), bool(layers))
        return {"layers": layers, "line": self._reward.first_line}

    def _copies(self, count: int) -> list[RewardFunction]:
        copies = []
        for copy in self._reward.copies(count):
            copies.append(copy)
            self._send_heartbeat(len(copies))
        return copies

    def _pay(
        self,
        rows: Iterator[tuple[int, Params]],
        copies: list[RewardFunction],
        paid: list[float],
        reply: dict[str, Any],
        is_traced: bool,
    ) -> None:
        for car, params in rows:
            if is_traced:
                trace = RewardTrace(copies[car])
                try:
                    paid.append(trace.call(params))
                finally:
                    reply.setdefault("traces", []).append(trace.traced.as_list())
                    reply["lines"] = sorted(trace.lines.union(reply.get("lines", ())))
            else:
                paid.append(copies[car].call(params))
            self._send_heartbeat(len(paid))

    def _send_heartbeat(self, count: int) -> None:
        if time.monotonic() - self._alive > self._alive_seconds:
            self._channel.send(to_head({"alive": count}))
            self._alive = time.monotonic()


class Course:
    """What rewards are told of a track and of what stands on it, and how a tick's bytes are read."""

    def __init__(self, request: Mapping[str, Any], waypoints: bytes) -> None:
        centre = np.frombuffer(waypoints).reshape(-1, 2)
        self._params = RewardParams(CentreLine(centre, request["length"]), request["reversed"])
        self._report = _dtype(request["report"])
        self._objects = request["objects"]
        self._state = _dtype(self._objects["state"]) if self._objects else _INT

    def rows(self, body: bytes, rows: int) -> Iterator[tuple[int, Params]]:
        """Yield each row's car and its dictionary."""
        take = _reader(body)
        cars, reports = take(_INT, rows), take(self._report, rows)
        objects = None
        if self._objects is not None:
            slots, asked = self._objects["slots"], self._objects
            objects = ObjectReports(
                take(_FLOAT, rows * slots * 6).reshape(rows, slots, 6),
                take(self._state, rows * slots).reshape(rows, slots),
                asked["objects"],
                asked["drive"],
                asked["speed"],
                take(_INT, rows) if asked["counted"] else None,
            )
        return zip(cars.tolist(), self._params.of(reports, objects, np.arange(rows)), strict=True)


def _reader(body: bytes) -> Callable[[np.dtype[Any], int], Array]:
    place = 0

    def take(dtype: np.dtype[Any], count: int) -> Array:
        nonlocal place
        part: Array = np.frombuffer(body, dtype, count, place)
        place += part.nbytes
        return part

    return take


def _dtype(described: list[list[str]]) -> np.dtype[Any]:
    return np.dtype([(name, kind) for name, kind in described])


def _with_waypoints(params: Params, body: bytes) -> Params:
    """Return a dictionary with its waypoints as the simulator gives them: tuples."""
    if body:
        params["waypoints"] = [(x, y) for x, y in np.frombuffer(body).reshape(-1, 2).tolist()]
    return params
