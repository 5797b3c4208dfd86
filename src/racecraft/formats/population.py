"""How a population was trained, as a JSON file: `population.json`, version 1. Begin with `PopulationRecord`.

{"format": "racecraft population", "version": 1, "command": […], "objective": "evaluation_score", "maximise": true,
 "parameters": {"ppo.learning_rate": "1e-4..1e-2:log"}, "size": 4, "rounds": 5, "seed": 0,
 "members": [{"round": 0, "member": 0, "values": {…}, "run": "0-0", "begun": 0, "parent": null, …}, …]}
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import RunFolderError
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import parse_json
from racecraft.formats.user_file import read_regular

FILE = "population.json"
FORMAT, VERSION = "racecraft population", 1


@dataclass(frozen=True)
class MemberRound:
    """One member of the population in one round."""

    round: int
    """Counted from 0."""
    member: int
    """Counted from 0."""
    values: Mapping[str, Any]
    """What it trains with, by parameter."""
    run: str
    """Its run folder, in that of the population's trials."""
    begun: int
    """Round in which that run began; a run goes on until its member takes over another's weights."""
    parent: int | None = None
    """Member whose weights of the round before it took over in this round; None: it went on with its own."""
    score: float | None = None
    """At the end of the round; None: it has not ended, or failed."""
    iteration: int | None = None
    """Of the run's last checkpoint then."""
    state: str = ""
    """COMPLETE or FAILED of `formats.tuning`; "": it has not ended."""
    seconds: float | None = None
    """Of this round."""
    note: str = ""
    """Why it failed."""


@dataclass(frozen=True)
class PopulationRecord:
    """A population as it stands."""

    command: tuple[str, ...]
    """What each member trains in a round, behind `racecraft`."""
    objective: str
    maximise: bool
    parameters: Mapping[str, str]
    """What is varied, as typed."""
    size: int
    rounds: int
    seed: int
    members: tuple[MemberRound, ...] = ()
    """In the order of rounds, then members."""

    def of_round(self, number: int) -> list[MemberRound]:
        """Return the members of one round."""
        return [one for one in self.members if one.round == number]

    def with_member(self, changed: MemberRound) -> PopulationRecord:
        """Return the record with one member's round changed or added."""
        others = [one for one in self.members if (one.round, one.member) != (changed.round, changed.member)]
        return replace(self, members=tuple(sorted([*others, changed], key=lambda one: (one.round, one.member))))

    def best_first(self, members: list[MemberRound]) -> list[MemberRound]:
        """Return members from the best to the worst; who has no score is last."""
        sign = 1.0 if self.maximise else -1.0

        def goodness(one: MemberRound) -> tuple[bool, float]:
            return one.score is not None, sign * (one.score or 0.0)

        return sorted(members, key=goodness, reverse=True)

    @property
    def best(self) -> MemberRound | None:
        """The best of all rounds; None where nobody has a score."""
        first = self.best_first(list(self.members))[:1]
        return first[0] if first and first[0].score is not None else None


def write_population(folder: Path, record: PopulationRecord) -> None:
    """Write the file into the population's folder.

    Raises:
        OutputFileError: It cannot be written.
    """
    document = {"format": FORMAT, "version": VERSION, **asdict(record)}
    write_atomic(folder / FILE, json.dumps(document, indent=2) + "\n")


def read_population(folder: Path) -> PopulationRecord | None:
    """Return the record in a folder; None where there is none.

    Raises:
        RunFolderError: The file is no such record.
    """
    path = folder / FILE
    if not path.is_file():
        return None
    try:
        document = parse_json(read_regular(path))
        if (document.pop("format"), document.pop("version")) != (FORMAT, VERSION):
            raise ValueError("another format or version")
        document["command"] = tuple(document["command"])
        document["members"] = tuple(MemberRound(**one) for one in document["members"])
        return PopulationRecord(**document)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise RunFolderError(
            "{path}: {error}; expected {file} of version {version}.", path=path, error=error, file=FILE, version=VERSION
        ) from error
