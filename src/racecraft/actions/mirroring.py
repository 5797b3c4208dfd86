"""What a training does with buckets: what it begins with comes down, what it leaves goes up while it trains."""

from __future__ import annotations

import contextlib
import shlex
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.stores import installation_at, open_store, reach

if TYPE_CHECKING:
    from racecraft.storage.mirror import Mirrored
    from racecraft.storage.mirror_note import MirrorLocation
    from racecraft.storage.object_store import ObjectStore
    from racecraft.training.callbacks import IterationReport, TrainingCallback

Tell = Callable[[str], None]
SHELF = Path("runs", "s3")
"""Where a run that was named by its address is laid: runs/s3/BUCKET/PREFIX."""
HISTORY = ("episodes", "evaluations", "training-simtrace", "mp4", "logs", "tensorboard")
"""Folders of a run, or of one of its workers, that are not needed to drive and to go on from it."""
NAMED = 3
"""So many files are named of those that a bucket lacks."""


def fetch_run(named: str, tell: Tell, folder: Path | None = None) -> str:
    """Return a run's folder, of one that is named by its address (s3://…[:best|last|N]) after fetching it.

    Raises:
        UserInputError: The address is none, or nothing comes from there.
    """
    from racecraft.formats.atomic import make_folder
    from racecraft.formats.checkpoint_ranking import split_source
    from racecraft.formats.run_folder import FOLDERS, JOB
    from racecraft.storage.address import Address, is_address
    from racecraft.storage.transfer import pull

    named = "s3://" + named.removeprefix("s3:/") if named.startswith("s3:/") and not is_address(named) else named
    if not is_address(named):
        return named
    text, which = split_source(named)
    address = Address.parse(text)
    target = SHELF / address.bucket / address.prefix
    tell(f"fetching {address} into {target}")
    pull(open_store(reach(address, folder)), address, target, chosen=is_needed_to_drive)
    for name in FOLDERS if (target / JOB).is_file() else ():  # a bucket keeps no folder that holds nothing
        make_folder(target / name)
    return f"{target}:{which}" if text != named else str(target)


def is_needed_to_drive(name: str) -> bool:
    """Tell whether a run's file is needed to drive with it and to go on from it.

    >>> [
    ...     is_needed_to_drive(name)
    ...     for name in ("checkpoints/3.policy.safetensors", "0/training-simtrace/3-iteration.csv")
    ... ]
    [True, False]
    """
    return not any(part in HISTORY or part.startswith("evaluation-") for part in name.split("/")[:-1])


def place_of_mirror(mirror: str | None, folder: Path | None, run: Path | None, tell: Tell) -> MirrorLocation | None:
    """Return where a run is to be kept as well; None: nowhere.

    Args:
        mirror: What was typed.
        folder: The racer's folder; where its bucket is S3, what a training lacks is fetched from there.
        run: A run that is gone on with; None: a new one.
        tell: Says a line.

    Raises:
        UserInputError: An address or a variable cannot be used.
    """
    if mirror is None and folder is None and run is None:
        return None  # nothing names a bucket: its code is not brought along
    from racecraft.storage.address import Address
    from racecraft.storage.mirror_note import MirrorLocation, noted_place

    if mirror is not None:
        address = Address.parse(mirror)
        return MirrorLocation(address, reach(address, folder), str(folder.absolute()) if folder is not None else "")
    if run is not None:
        noted = noted_place(run)
        if noted is None or not noted.installation:
            return noted
        known = noted.access
        found = reach(noted.address, Path(noted.installation), known.endpoint, known.profile, known.region)
        return replace(noted, access=found)
    installation = installation_at(folder)
    return None if installation is None else installation.mirror(tell)


@contextlib.contextmanager
def mirrored(
    shown: TrainingCallback, place: MirrorLocation | None, tell: Tell, run: Path | None = None
) -> Iterator[TrainingCallback]:
    """Yield who watches a training so that its run is kept in a bucket; say in the end what that bucket lacks.

    Args:
        shown: Who watches beside.
        place: Where it is kept; None: nowhere.
        tell: Says a line.
        run: A run that is gone on with; None: a new one, for which the place must be free.

    Raises:
        UserInputError: The bucket refuses it, or holds another run there.
    """
    if place is None:
        yield shown
        return
    from racecraft.training.callbacks import Callbacks

    store = open_store(place.access)
    _require_free_prefix(store, place, run, tell)
    watching = _MirrorCallback(place, store)
    try:
        yield Callbacks(shown, watching)
    finally:
        done = watching.close()
        if done is not None:
            tell(what_was_mirrored(done, watching.run, place))


def what_was_mirrored(done: Mirrored, run: Path, place: MirrorLocation) -> str:
    """Return the line about how far a mirror came."""
    if not done.missing:
        return f"mirrored: {place.address} holds all of {run}"
    more = len(done.missing) - NAMED
    named = ", ".join(done.missing[:NAMED]) + (f" and {more} more" if more > 0 else "")
    why = f" {done.trouble}" if done.trouble else ""
    return (
        f"not mirrored: {place.address} lacks {named}.{why}\nThe run itself is whole. "
        f"racecraft bucket push {shlex.quote(str(run))} {place.command} brings the rest there."
    )


def _require_free_prefix(store: ObjectStore, place: MirrorLocation, run: Path | None, tell: Tell) -> None:
    """Refuse a prefix that holds something else than the run that is kept there."""
    from racecraft.formats.run_folder import JOB
    from racecraft.storage.address import BucketError
    from racecraft.storage.etags import is_same
    from racecraft.storage.object_store import NetworkError

    try:
        found = store.listed(place.address)
    except NetworkError as error:
        tell(f"- {error} The training begins all the same, and the bucket is tried again.")
        return
    job_object = found.get(JOB)
    is_ours = run is not None and (job_object is None or is_same(run / JOB, job_object.size, job_object.etag))
    if found and not is_ours:
        raise BucketError(
            "{address}: holds {count} objects already; expected a free prefix for this run. Give another "
            "one (DR_LOCAL_S3_MODEL_PREFIX, --mirror).",
            address=place.address,
            count=len(found),
        )


class _MirrorCallback:
    """Tells a mirror of each iteration; it begins when the run folder stands."""

    def __init__(self, place: MirrorLocation, store: ObjectStore) -> None:
        from racecraft.storage.mirror import Mirror

        self._place, self._store, self._make = place, store, Mirror
        self._mirror: Mirror | None = None
        self.run = Path()

    def run_made(self, path: Path) -> None:
        """Begin to mirror it."""
        from racecraft.storage.mirror_note import write_note

        write_note(path, self._place)
        self.run = path
        self._mirror = self._make(path, self._place.address, self._store)
        self._mirror.changed()

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Nothing is new."""

    def iteration(self, report: IterationReport) -> None:
        """Something is new."""
        if self._mirror is not None:
            self._mirror.changed()

    def end(self, reason: str) -> None:
        """The rest is written behind this; `close` has it mirrored."""

    def close(self) -> Mirrored | None:
        """Have the rest mirrored; None where nothing was begun."""
        return None if self._mirror is None else self._mirror.close()
