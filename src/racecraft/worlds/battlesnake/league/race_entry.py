"""A snake at entry: copied so that it can be played from its own folder, and checked. Begin with `admit_snake`.

    player.json    {"version": 1, "player": "search+run"}; `run` and `snake.py` are what lies beside it
    run/           a run folder of one checkpoint
    snake.py       a stranger's code: it plays in a process that can compute and nothing else

A server's program may change behind its address; a board says so.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError, SettingError, nearest
from racecraft.formats.archive import is_archive
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.user_file import read_regular
from racecraft.isolation.layers import can_isolate
from racecraft.league.model_copy import copy_checkpoint, run_in_archive
from racecraft.worlds.battlesnake.evaluation.seats import Seat, take_seat
from racecraft.worlds.battlesnake.league.race_rules import SnakeRules
from racecraft.worlds.battlesnake.players.find import PLAYERS
from racecraft.worlds.battlesnake.players.trained import KIND

CARD, RUN, FILE = "player.json", "run", "snake.py"
BEFORE = ("search+", "search:")
"""Search on top of another player, and search that asks a run about every position."""
KEPT_OF_JOB = ("kind", "title", "algorithm", "settings")
ARCHIVE_KIND = "an archive of a run folder (.tar.gz or .zip)"
MAX_FILE_BYTES = 1 << 22


def admit_snake(source: str, folder: Path, rules: SnakeRules) -> dict[str, Any]:
    """Copy a player into a folder that does not exist yet, let it sit down once, and return its facts.

    Args:
        source: A built-in name, an address, a FILE.py, RUN[:best|last|N] or an archive of one, maybe behind `search+`.
        folder: Becomes the player's.
        rules: Of the race.

    Raises:
        UserInputError: It cannot be used, or the rules refuse it.
    """
    make_folder(folder)
    before = next((one for one in BEFORE if source.startswith(one) and not Path(source).exists()), "")
    what = _copied(source.removeprefix(before), folder, rules)
    write_atomic(folder / CARD, json.dumps({"version": 1, "player": before + what}) + "\n")
    seat_of(folder, "", 0, rules).leave()
    return _facts(folder, before, what)


def seat_of(folder: Path, name: str, seed: int, rules: SnakeRules) -> Seat:
    """Return a seat for a player that was admitted.

    Args:
        folder: The player's.
        name: Of the racer.
        seed: Of a player that rolls dice.
        rules: Of the race.

    Raises:
        UserInputError: Its files are damaged, or its server does not answer.
    """
    player = player_in(folder)
    before = next((one for one in BEFORE if player.startswith(one)), "")
    what = player.removeprefix(before)
    where = str(folder / what) if what in (RUN, FILE) else what
    return take_seat(before + where, name, seed, rules.file_memory, is_isolated=True)


def player_in(folder: Path) -> str:
    """Return what a player's card says: "search+run".

    Raises:
        InputFileError: There is none, or it is damaged.
    """
    try:
        player = json.loads(read_regular(folder / CARD))["player"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputFileError(folder / CARD, "no card of a player", "one that a league wrote", str(error)) from error
    return str(player)


def needs_others(folder: Path) -> bool:
    """Tell whether a player is a server, or code in a process of its own."""
    player = player_in(folder)
    return "://" in player or player.endswith(FILE)


def _copied(what: str, folder: Path, rules: SnakeRules) -> str:
    """Copy what a player needs, and return how its card names it."""
    if "://" in what:
        _require(rules.addresses, "an address", what)
        return what
    if what in PLAYERS and not Path(what).exists():
        return what
    if is_archive(what):
        with tempfile.TemporaryDirectory(prefix="racecraft-entry-", ignore_cleanup_errors=True) as place:
            run = run_in_archive(Path(what), Path(place), ARCHIVE_KIND)
            if run is None:
                raise InputFileError(Path(what), "no run folder in it", ARCHIVE_KIND)
            return _copy_run(run, "best", folder)
    path, which = split_source(what)
    if Path(path).is_dir():
        return _copy_run(RunFolder.open(path), which, folder)
    return _copy_file(Path(what), folder, rules)


def _copy_run(run: RunFolder, which: str, folder: Path) -> str:
    job = run.read_job_of(KIND)
    game = (job.get("asked") or {}).get("game", {})
    kept = {name: job[name] for name in KEPT_OF_JOB if name in job} | {"asked": {"game": game}}
    copy_checkpoint(run, which, folder / RUN, kept)
    return RUN


def _copy_file(file: Path, folder: Path, rules: SnakeRules) -> str:
    if not file.is_file():
        hint = nearest(str(file), list(PLAYERS))
        raise SettingError("there is no player {name!r}; expected a RUN, an archive of one, a FILE.py, an address or a "
                           "built-in player. {hint}", name=str(file), hint=hint)  # fmt: skip
    _require(rules.files, "a file", str(file))
    if not can_isolate():
        raise SettingError("{file}: this system cannot isolate a stranger's code; expected a RUN, an address or a "
                           "built-in player.", file=file)  # fmt: skip
    if file.stat().st_size > MAX_FILE_BYTES:
        raise InputFileError(file, "a file of more than 4 MiB", "a FILE.py")
    write_atomic(folder / FILE, read_regular(file))
    return FILE


def _require(allowed: bool, what: str, found: str) -> None:
    if not allowed:
        raise SettingError("this race refuses {what} ({found}); expected another kind of player. "
                           "`racecraft league show` tells which may enter.", what=what, found=found)  # fmt: skip


def _facts(folder: Path, before: str, what: str) -> dict[str, Any]:
    """Return what a board may say of a player, fit for JSON."""
    kind = {RUN: "run", FILE: "file"}.get(what, "address" if "://" in what else "built-in")
    facts: dict[str, Any] = {"player": kind, "search": bool(before)}
    if kind == "run":
        job = RunFolder.open(folder / RUN).read_job()
        facts |= {"algorithm": job.get("algorithm", "")}
    if kind == "file":
        facts |= {"sha256": hashlib.sha256((folder / FILE).read_bytes()).hexdigest()}
    return facts
