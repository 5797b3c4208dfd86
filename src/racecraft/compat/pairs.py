"""Two jobs of a SageMaker script, one that learns and one that carries its worlds. Begin with `spread_to_secondary`.

At SageMaker the primary and the secondary find each other through a prefix in S3, and the user counts workers by hand
(facts: battlesnake-and-sagemaker-rl.md C.5). Here both are jobs of one machine, the prefix names a folder beside the
jobs, and a secondary brings a worker for each of its cores. Its instances are cores of one job.
"""

from __future__ import annotations

import multiprocessing
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from racecraft.cluster.asked import ClusterAsked
from racecraft.cluster.meeting import MEET_SECONDS, MeetingTransport, attend
from racecraft.cluster.spreading import spread_by
from racecraft.contract.errors import SettingError
from racecraft.jobs.home import JobHome
from racecraft.training.trainer import Spread

CLUSTER_TYPE, SECONDARIES, PREFIX, BUCKET = "rl_cluster_type", "rl_num_instances_secondary", "s3_prefix", "s3_bucket"
PRIMARY, SECONDARY = "primary", "secondary"
MEETINGS = "meetings"
NOT_A_NAME = re.compile(r"[^A-Za-z0-9_-]+")


def role_of(words: Mapping[str, Any]) -> str | None:
    """Return which of two jobs a script's hyperparameters make it; None: it is alone.

    Raises:
        SettingError: `rl_cluster_type` is something else.
    """
    role = words.get(CLUSTER_TYPE)
    if role not in (None, PRIMARY, SECONDARY):
        raise SettingError(f"{CLUSTER_TYPE} is '{role}'; expected {PRIMARY} or {SECONDARY}.")
    return None if role == PRIMARY and not int(words.get(SECONDARIES, 0)) else role


def spread_to_secondary(words: Mapping[str, Any], seconds: float = MEET_SECONDS) -> Spread:
    """Return what carries a primary's worlds to its secondary, which must come within so many seconds.

    Raises:
        SettingError: No prefix says where they meet.
    """
    place = meeting_place(words)
    print(f"- waiting for the secondary job, at most {seconds:.0f} s", flush=True)
    return spread_by(lambda: MeetingTransport(place, seconds), ClusterAsked(None, SECONDARY))


def carry_for_primary(words: Mapping[str, Any], seconds: float = MEET_SECONDS) -> None:
    """Carry worlds for the primary until it says that all is over, with a worker for each core of this job.

    Raises:
        ClusterError: It did not come within so many seconds.
        SettingError: No prefix says where they meet.
    """
    place, cores = meeting_place(words), max(1, int(os.environ.get("SM_NUM_CPUS") or 1))
    forks = "fork" in multiprocessing.get_all_start_methods()
    workers = cores if forks else 1  # elsewhere a child knows nothing of the script's environment
    party = f"{os.environ.get('SAGEMAKER_JOB_NAME', '')}:{os.getpid()}"
    print(
        f"- {workers} worker{'s' * (workers > 1)} for the primary job, waited for at most {seconds:.0f} s", flush=True
    )
    others = [
        multiprocessing.get_context("fork").Process(target=attend, args=(place, party, workers, seconds), daemon=True)
        for _ in range(workers - 1)
    ]
    for other in others:
        other.start()
    answered = attend(place, party, workers, seconds)
    for other in others:
        other.join()
    print(f"- the primary is done; {answered} questions were answered here")


def meeting_place(words: Mapping[str, Any]) -> Path:
    """Return the folder where two jobs meet.

    Raises:
        SettingError: They have no prefix.
    """
    if not words.get(PREFIX):
        raise SettingError(
            f"{CLUSTER_TYPE} is given and {PREFIX} is not; expected the same {PREFIX} for the primary and the "
            "secondary: by it they find each other."
        )
    name = NOT_A_NAME.sub("-", f"{words.get(BUCKET, '')}-{words[PREFIX]}").strip("-")
    return JobHome.of_user().path / MEETINGS / name
