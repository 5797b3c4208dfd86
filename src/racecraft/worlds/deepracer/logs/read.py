"""The door: `read(ANYTHING)`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from racecraft.contract.errors import nearest
from racecraft.contract.message import Message
from racecraft.worlds.deepracer.logs.columns import PHASES
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.sources import LOG, Source, find_sources
from racecraft.worlds.deepracer.logs.table import Logs


def read(what: str | Path | Iterable[str | Path], phase: str | None = None) -> Logs:
    """Find the logs in whatever is given.

    Args:
        what: A run folder of ours; a DeepRacer for Cloud prefix with one worker or several; a folder or .tar.gz that
            the console or DeepRacer on AWS handed out; a simulation log (pieces that rolled over as .1, .2, ... are
            found beside it); a trace (.csv); metrics (.json). Several folders or archives are rounds of one training,
            in the order given; several loose files are one round.
        phase: training, evaluation or leaderboard, for loose files; None: the path tells, or else the rows do.

    Returns:
        What was found; files are opened when something in them is asked for.

    Raises:
        LogError: There is nothing at a path, no log in it, or no such phase.
    """
    if phase is not None and phase not in PHASES:
        raise LogError(
            "phase", repr(phase), Message("one of {phases}", phases=", ".join(PHASES)), nearest(phase, PHASES)
        )
    paths = [Path(what)] if isinstance(what, str | Path) else [Path(one) for one in what]
    sources: list[Source] = []
    rounds, loose = 0, 0
    for path in paths:
        found = find_sources(path)
        if _is_loose(path):
            loose = loose or rounds + 1
            found = [replace(source, round=loose, phase=phase or source.phase) for source in found + _pieces(path)]
            sources += sorted(found, key=lambda source: source.part is None)
            rounds = max(rounds, loose)
        else:
            sources += [source.placed(source.round + rounds, source.stream) for source in found]
            rounds = max(source.round for source in sources)
    return Logs(tuple(sources), phase, is_one_training=len(paths) > 1)


def _is_loose(path: Path) -> bool:
    return path.is_file() and path.suffix in (".csv", ".json", ".parquet", ".log", ".txt")


def _pieces(path: Path) -> list[Source]:
    """Return the pieces of a log that rolled over: NAME.1, NAME.2, ... beside it."""
    if path.suffix not in (".log", ".txt"):
        return []
    pieces: list[Source] = []
    while (piece := path.with_name(f"{path.name}.{len(pieces) + 1}")).is_file():
        pieces.append(Source(str(piece), LOG, str(path), part=len(pieces) + 1))
    return pieces
