"""A process that drives one heat and ends: warmed before the heat is known, used once. Begin with `DriveProcess`.

A heat's models are strangers' files. Nothing of them is code (`admit` refuses such); still a process of its own keeps
what one leaves behind from the next, has a limit of time, and a crash is one failed entry. Once it is warm and knows
what it drives it gives up everything else (`isolation/`): it reads the interpreter, the packages and these models, and
writes into a folder of its own that goes with it.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import threading
import time
import traceback
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Any

import msgspec

from racecraft.contract.errors import RacecraftError
from racecraft.isolation.channel import Channel, from_head, to_head
from racecraft.isolation.layers import restrict
from racecraft.isolation.process import CodeProcess, EndedError
from racecraft.isolation.readable import files_of_python
from racecraft.kernels.compile import cache_folder, write_nothing
from racecraft.league.race import Outcome, Places
from racecraft.league.world_part import Driven, DriveOrder, OnProgress, league_world, no_progress

WARM_SECONDS, DRIVE_SECONDS = 300.0, 600.0
"""How long a process may import and compile; how long it may drive."""
PROGRESS_SECONDS = 0.4
"""How often its owner learns how far it is."""
MEMORY_BYTES, FILE_BYTES = 4 << 30, 256 << 20
"""How much memory it may have, and how long a file that it writes may be."""


_Progress = tuple[float, str, Places]


class DriveError(Exception):
    """A heat could not be driven; the message says why."""


class DriveProcess:
    """A process for one heat.

    `layers` names what it has given up, such as "Landlock 7", once it drives; empty where the system has no limits, or
    a drive needs other processes or machines.

    Args:
        kind: Whose world.
        readable: What it may read beside the models that it drives first.
    """

    def __init__(self, kind: str, readable: Sequence[Path] = ()) -> None:
        self._process = CodeProcess(__name__, has_environment=True)
        self._kind, self._readable, self.layers = kind, readable, tuple[str, ...]()
        self._scratch = tempfile.TemporaryDirectory(prefix="racecraft-drive-", ignore_cleanup_errors=True)
        self._warming = threading.Thread(target=self._warm_up, daemon=True)
        self._warming.start()

    def __enter__(self) -> DriveProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def is_warm(self) -> bool:
        """Whether it has imported and compiled what a drive needs."""
        return not self._warming.is_alive()

    def close(self) -> None:
        """End the process."""
        self._process.close()
        self._scratch.cleanup()

    def drive(self, order: DriveOrder, recorded: Path | None = None, on_progress: OnProgress = no_progress) -> Driven:
        """Drive on one track.

        Args:
            order: What is driven.
            recorded: The folder of an earlier drive, whose actions are driven again; None: the models act.
            on_progress: Is called about twice a second.

        Raises:
            DriveError: It cannot be driven, crashed, or did not end in time.
        """
        self._warming.join()
        request: dict[str, Any] = {
            "kind": self._kind,
            "order": asdict(order),
            "recorded": str(recorded) if recorded else None,
        }
        if not self.layers:
            places = [*self._readable, *order.models, *order.files, *([recorded] if recorded else ())]
            request |= {"readable": [str(place) for place in places], "scratch": self._scratch.name}
        head, body = self._ask(request, DRIVE_SECONDS, on_progress)
        self.layers = self.layers or tuple(head["layers"])
        outcomes = msgspec.convert(head["outcomes"], tuple[Outcome, ...])
        files, at = {}, 0
        for name, size in head["files"]:
            files[name] = body[at : at + size]
            at += size
        return Driven(outcomes, files)

    def _warm_up(self) -> None:
        with contextlib.suppress(DriveError):  # which the drive will meet again
            self._ask({"warm_up": self._kind}, WARM_SECONDS)

    def _ask(
        self, request: dict[str, Any], seconds: float, on_progress: OnProgress = no_progress
    ) -> tuple[dict[str, Any], bytes]:
        try:
            head, body = self._process.ask(
                to_head(request), b"", seconds, lambda value: on_progress(*msgspec.convert(value, _Progress))
            )
        except EndedError as error:
            how = f"took longer than {seconds:g} s" if error.was_late else error.found
            raise DriveError(f"the process that drove {how}") from error
        if "error" in head:
            raise DriveError(str(head["error"]))
        return head, body


def main() -> None:
    """Answer the owner until it closes the pipe."""
    channel = Channel(0, os.dup(1))
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what is printed is no message
    try:
        while True:
            head, _ = channel.receive()
            try:
                channel.send(*_answer(from_head(head), _sender(channel)))
            except RacecraftError as error:
                channel.send(to_head({"error": str(error)}))
    except EOFError:
        os._exit(0)
    except BaseException:
        traceback.print_exc()
        os._exit(1)


def _sender(channel: Channel) -> OnProgress:
    """Return what sends the owner how far a drive is, at most every PROGRESS_SECONDS."""
    due = 0.0

    def send(share: float, text: str, places: Places) -> None:
        nonlocal due
        if time.monotonic() >= due:
            channel.send(to_head({"told": (share, text, places)}))
            due = time.monotonic() + PROGRESS_SECONDS

    return send


def _answer(request: dict[str, Any], on_progress: OnProgress) -> tuple[bytes, bytes]:
    if "warm_up" in request:
        league_world(str(request["warm_up"])).warm_up()
        return b"", b""
    order = msgspec.convert(request["order"], DriveOrder)
    world = league_world(str(request["kind"]))
    recorded = request["recorded"]
    may_limit = "scratch" in request and (recorded is not None or world.is_alone(order))
    layers = _limit(request["readable"], request["scratch"]) if may_limit else ()
    driven = world.drive(order, on_progress) if recorded is None else world.redrive(order, Path(str(recorded)))
    outcomes = msgspec.to_builtins(driven.outcomes)
    files = [(name, len(data)) for name, data in driven.files.items()]
    return to_head({"outcomes": outcomes, "files": files, "layers": layers}), b"".join(driven.files.values())


def _limit(readable: Sequence[str], scratch: str) -> tuple[str, ...]:
    """Give up everything but computing, reading what is named, and writing into one folder."""
    compiled = str(cache_folder())
    layers = restrict([*files_of_python(), *readable, compiled], MEMORY_BYTES, scratch, FILE_BYTES, threads=True)
    write_nothing()
    tempfile.tempdir = scratch
    return layers
