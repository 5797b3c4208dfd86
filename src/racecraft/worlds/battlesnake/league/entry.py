"""A player let into an arena: found once, pinned to what it is today, and known again whenever it plays.

A rating is worth something only as long as the player behind it stays the same. A RUN is pinned to the checkpoint that
it has now; a FILE.py and a checkpoint's weights leave their fingerprint. Nobody can see into a server behind an
address, and search is as strong as its machine is fast, so these may play but never hold the scale.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from racecraft.formats.checkpoint_ranking import find_checkpoint, split_source
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.battlesnake.evaluation.seats import take_seat
from racecraft.worlds.battlesnake.league.terms import ArenaError, Entrant
from racecraft.worlds.battlesnake.players.find import PLAYERS, WEIGHED

SEARCH = "search"
ON_TOP = "search+"


def entrant_of(what: str, name: str = "", anchor: bool = False) -> Entrant:
    """Return who is meant, after it sat down once.

    Args:
        what: A built-in name, an address, a FILE.py or a RUN, maybe behind `search+`.
        name: What it is called in the arena; `what`, where empty.
        anchor: Whether it holds the scale.

    Raises:
        PlayerError: There is no such player, or the server does not answer.
        ArenaError: It cannot hold the scale.
        RunFolderError: No run folder, or the run of something else.
        CheckpointError: No such checkpoint, or a damaged one.
    """
    if anchor and ("://" in what or what == SEARCH or what.startswith((ON_TOP, WEIGHED))):
        raise ArenaError(
            "{what}: it may change (a server its program, search with the machine); expected an anchor that never "
            "does: {players}, a FILE.py or a RUN.",
            what=what,
            players=", ".join(one for one in PLAYERS if one != SEARCH),
        )
    take_seat(what).leave()
    source = pinned(what)
    return Entrant(0, name or what, source, fingerprint(source), anchor)


def pinned(what: str) -> str:
    """Return where exactly a player is found, from any folder: whole paths, and the checkpoint that a RUN has now."""
    if what.startswith(ON_TOP) and not Path(what).is_file():
        return ON_TOP + pinned(what.removeprefix(ON_TOP))
    if "://" in what or (what in PLAYERS and not Path(what).is_file()):
        return what
    if what.startswith(WEIGHED):
        return WEIGHED + pinned(what.removeprefix(WEIGHED))
    if Path(what).is_file():
        return str(Path(what).resolve())
    path, which = split_source(what)
    entry = find_checkpoint(RunFolder.open(path), which)
    return f"{Path(path).resolve()}:{entry.iteration}"


def fingerprint(source: str) -> str:
    """Return a hash of the file or of the weights behind a source; "" where there is neither.

    Raises:
        ArenaError: The file is gone.
        RunFolderError: The run is.
        CheckpointError: The checkpoint is.
    """
    source = source.removeprefix(ON_TOP).removeprefix(WEIGHED)
    if "://" in source or source in PLAYERS:
        return ""
    path = Path(source)
    if not source.endswith((".py", ".json")) and not path.is_file():
        run, which = split_source(source)
        folder = RunFolder.open(run)
        path = folder.checkpoints / find_checkpoint(folder, which).policy
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as problem:
        raise ArenaError(
            "{path}: cannot be read ({strerror}); expected the player that was let in.",
            path=path,
            strerror=problem.strerror,
        ) from problem


def require_same(entrant: Entrant) -> None:
    """Refuse a player that is no longer what it was when it came in.

    Raises:
        ArenaError: It has changed or is gone.
        RunFolderError: Its run is gone.
        CheckpointError: Its checkpoint is.
    """
    if fingerprint(entrant.source) != entrant.fingerprint:
        raise ArenaError(
            "{name}: {source} has changed since it came in; expected the same player. "
            "Bring it back, or let it in anew under another --name and `arena remove {name}`.",
            name=entrant.name,
            source=entrant.source,
        )
