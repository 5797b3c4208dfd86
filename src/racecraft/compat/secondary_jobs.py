"""The primary and the secondary job of a SageMaker script. Begin with `wait_for_primary`.

At SageMaker the secondary's machines carry the primary's worlds (facts: battlesnake-and-sagemaker-rl.md C.5). Here both
are jobs of one machine: the primary trains on all its cores, and the secondary waits until the primary ends. They find
each other by the prefix that their hyperparameters share, which names a lock file beside the jobs.
"""

from __future__ import annotations

import datetime
import re
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.formats.atomic import make_folder
from racecraft.formats.run_lock import FileLock, holder_of
from racecraft.jobs.job_paths import JobPaths

CLUSTER_TYPE, SECONDARIES, PREFIX, BUCKET = "rl_cluster_type", "rl_num_instances_secondary", "s3_prefix", "s3_bucket"
PRIMARY, SECONDARY = "primary", "secondary"
PRIMARIES = "primaries"
NOT_A_NAME = re.compile(r"[^A-Za-z0-9_-]+")
WAIT_SECONDS, POLL_SECONDS = 600.0, 0.2
"""SageMaker's launcher waits 600 s for a machine (facts: battlesnake-and-sagemaker-rl.md C.5)."""


class PrimaryMissingError(UserInputError):
    """The secondary's primary did not start in time."""


def role_of(words: Mapping[str, Any]) -> str | None:
    """Return which of two jobs a script's hyperparameters make it; None: it has no other.

    Raises:
        SettingError: `rl_cluster_type` is something else.
    """
    role = words.get(CLUSTER_TYPE)
    if role not in (None, PRIMARY, SECONDARY):
        raise SettingError(
            "{cluster_type} is '{role}'; expected {primary} or {secondary}.",
            cluster_type=CLUSTER_TYPE,
            role=role,
            primary=PRIMARY,
            secondary=SECONDARY,
        )
    return None if role == PRIMARY and not int(words.get(SECONDARIES, 0)) else role


def primary_lock(words: Mapping[str, Any]) -> FileLock:
    """Return the lock that the primary holds while it trains.

    Raises:
        SettingError: The hyperparameters have no prefix, or another primary holds the lock.
    """
    path = _lock_path(words)
    make_folder(path.parent)
    return FileLock(
        path,
        lambda holder: SettingError(
            "{prefix} is {words!r}, and another primary trains with it ({holder}); expected one primary for "
            "each {prefix}. Wait for it, or give another {prefix}.",
            prefix=PREFIX,
            words=words[PREFIX],
            holder=holder,
        ),
    )


def wait_for_primary(words: Mapping[str, Any], seconds: float = WAIT_SECONDS) -> None:
    """Return when the primary has ended; its lock file is removed, so that the next pair starts without it.

    Raises:
        PrimaryMissingError: It did not start within `seconds`.
        SettingError: The hyperparameters have no prefix.
    """
    path = _lock_path(words)
    print(f"- waiting for the primary job, at most {seconds:.0f} s until it starts", flush=True)
    until = time.monotonic() + seconds
    while not path.exists():
        if time.monotonic() > until:
            raise PrimaryMissingError(
                "{name}: no primary started within {seconds:.0f} s; expected a primary job with the same "
                "{bucket} and {prefix}. `racecraft jobs list` shows whether it waits for cores.",
                name=path.name,
                seconds=seconds,
                bucket=BUCKET,
                prefix=PREFIX,
            )
        time.sleep(POLL_SECONDS)
    time.sleep(POLL_SECONDS)  # a lock file is made before it says who holds it
    while holder_of(path) is not None:
        time.sleep(POLL_SECONDS)
    ended = datetime.datetime.fromtimestamp(path.stat().st_mtime).isoformat(" ", "seconds")
    path.unlink()
    print(f"- the primary trained with all cores and ended at {ended}; nothing is left to do here")


def _lock_path(words: Mapping[str, Any]) -> Path:
    if not words.get(PREFIX):
        raise SettingError(
            "{cluster_type} is given and {prefix} is not; expected the same {prefix} for the primary and the "
            "secondary: by it they find each other.",
            cluster_type=CLUSTER_TYPE,
            prefix=PREFIX,
        )
    name = NOT_A_NAME.sub("-", f"{words.get(BUCKET, '')}-{words[PREFIX]}").strip("-")
    return JobPaths.of_user().path / PRIMARIES / f"{name}.lock"
