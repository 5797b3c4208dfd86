"""Which files below a path are logs, and what each tells: phase, stream, round, worker, iteration.

Begin with `find_sources`. A file is known by the tail of its path, whichever tool laid it out; what stands before that
tail is the model's own folder, and each such folder is a round of its own. Sources come in the order in which they
happened, so that their rows need no sorting.

Layouts: facts: DeepRacer for Cloud with one worker and several, the console's log archive, DeepRacer on AWS
(`sim-trace`, `logs`, `metrics` below a model), our run folder.
"""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from io import BufferedReader, BytesIO
from operator import itemgetter
from pathlib import Path
from typing import Any

from racecraft.formats.archive import is_archive
from racecraft.formats.json_text import parse_json
from racecraft.formats.run_folder import FORMAT as RUN_FORMAT
from racecraft.formats.run_folder import JOB
from racecraft.formats.user_file import read_regular
from racecraft.worlds.deepracer.logs.archive import GzippedFile, MemberFile, members
from racecraft.worlds.deepracer.logs.errors import LogError

TRACE, LOG, METRICS, EPISODES, ABOUT = "trace", "log", "metrics", "episodes", "about"
EXPECTED = (
    "a run folder, a DeepRacer model or log folder, its .tar.gz, a simulation log, a simulation trace (.csv) or "
    "metrics (.json)"
)
_TRACE = re.compile(r"(?P<tail>(?:^|/)(?:(?P<worker>\d{1,9})/)?(?P<phase>training|evaluation|leaderboard)-simtrace/"
                    r"(?P<iteration>\d{1,9})-iteration\.csv)$")  # fmt: skip
_OWN_FOLDER = re.compile(r"(?:^|/)(?:sim-trace/(?:training|evaluation|leaderboard)(?:/(?P<long>[^/]+))?|"
                         r"evaluation-(?P<stamp>\d+)|sim-trace)$")  # fmt: skip
_LOG = re.compile(r"(?P<tail>(?:^|/)(?:logs/)?(?:(?P<phase>training|evaluation|leaderboard|robomaker)/)?"
                  r"(?P<name>[^/]+)\.log(?:\.(?P<part>\d{1,9}))?)$")  # fmt: skip
_METRICS = re.compile(r"(?P<tail>(?:^|/)metrics/(?:(?P<phase>training|evaluation)/)?(?P<name>[^/]+)\.json)$")
_LOOSE_METRICS = re.compile(r"(?P<tail>(?:^|/)(?P<name>(?P<phase>training|evaluation)-\d{14}[^/]*|TrainingMetrics[^/]*|"
                            r"EvaluationMetrics[^/]*)\.json)$")  # fmt: skip
_COACH = re.compile(r"(?P<tail>(?:^|/)[^/]*\.agent_\d{1,9}\.csv)$")
_COACH_BEGINS = b"Episode #,"
_EPISODES = re.compile(r"(?P<tail>(?:^|/)episodes/(?P<number>\d{1,9})\.parquet)$")
_ABOUT = re.compile(r"(?P<tail>(?:^|/)(?:model/model_metadata\.json|ip/hyperparameters\.json|training_params\.yaml|"
                    r"model_metadata\.json|hyperparameters\.json|job\.json))$")  # fmt: skip
_ITERATION = re.compile(r"(?<!\d)(\d{1,9})-iteration\.csv$")
_PHASE = re.compile(r"(training|evaluation|leaderboard)", re.IGNORECASE)
_METRICS_WORKER = re.compile(r"TrainingMetrics_(\d{1,9})$")
PACKED = (".csv.gz", ".log.gz", ".json.gz")
"""Endings of a file that was compressed by itself."""
_STAMP = re.compile(r"(\d{14})")


@dataclass(frozen=True)
class Source:
    """A file that tells something."""

    file: str | MemberFile | GzippedFile
    """The path of a file, or one in an archive; to make a `Path` of each would take half of the time to find them."""
    kind: str
    """TRACE, LOG, METRICS, EPISODES or ABOUT."""
    root: str
    """The model's own folder."""
    phase: str | None = None
    """One of PHASES; None: the rows must tell."""
    stream: str = ""
    worker: int = 0
    iteration: int = 0
    round: int = 1
    part: int | None = None
    """Number of a piece of a log that rolled over; None: the last one."""

    @property
    def name(self) -> str:
        """The file, as the user would name it."""
        return str(self.file)

    @property
    def is_log(self) -> bool:
        """Whether it is a simulation log, also one whose rows stand in traces."""
        name = self.name.rsplit("/", 1)[-1]
        return ".log" in name or name.endswith(".txt")

    def open(self) -> BufferedReader | BytesIO:
        """Open the file for reading."""
        return open(self.file, "rb") if isinstance(self.file, str) else BytesIO(self.file.data)

    def placed(self, round: int, stream: str) -> Source:
        """Return the file as one of a round and of a stream."""
        return self if (round, stream) == (self.round, self.stream) else replace(self, round=round, stream=stream)

    def read(self) -> bytes:
        """Return what the file holds."""
        return read_regular(self.file) if isinstance(self.file, str) else self.file.data


def find_sources(path: str | Path, traces_first: bool = False) -> list[Source]:
    """Return the logs at a path: a file, an archive, or a folder with whatever lies below it.

    Args:
        path: The file, archive or folder.
        traces_first: Where a run of ours has both, its traces instead of its own episodes.

    Raises:
        LogError: There is nothing at the path, or no log in it.
    """
    path = Path(path)
    if path.is_dir():
        found = [classified for name, file in _below(path) if (classified := _unpacked(name, file))]
    elif not path.exists():
        raise LogError(path, "there is no such file or folder", EXPECTED)
    elif not path.is_file():
        raise LogError(path, "is neither file nor folder, but a pipe or a device", EXPECTED)
    elif path.name.endswith(PACKED):
        found = [_single(path)]
    elif is_archive(path):
        found = [classified for member in members(path) if (classified := _classified(member.name, member))]
    else:
        found = [_single(path)]
    if not any(source.kind != ABOUT for source in found):
        raise LogError(path, "no log was found there", EXPECTED)
    return _in_order(_without_doubles(_with_phases(found), traces_first))


def _below(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the files below a folder: their path in it, with forward slashes, and as one opens them."""
    for place, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        below, here = Path(place).relative_to(folder).as_posix(), str(Path(place))
        before = "" if below == "." else f"{below}/"
        here = "" if here == "." else os.path.join(here, "")
        yield from ((before + name, here + name) for name in files)


def _unpacked(name: str, file: str) -> Source | None:
    """Return what a file below a folder is, also one that was compressed by itself."""
    if name.endswith(PACKED):
        return _classified(name.removesuffix(".gz"), GzippedFile(Path(file)))
    return _classified(name, file)


def _classified(name: str, file: str | MemberFile | GzippedFile) -> Source | None:
    """Return what a file below a folder is, by its path in it; None where it is no log."""
    if match := _TRACE.search(name):
        return _trace(name, file, match)
    if match := _ITERATION.search(name):
        return _bare_trace(name, file, match)
    if match := _METRICS.search(name) or _LOOSE_METRICS.search(name):
        stamp = _STAMP.search(match["name"])
        worker = _METRICS_WORKER.search(match["name"])
        evaluation = match["phase"] == "evaluation" or match["name"].startswith("EvaluationMetrics")
        stream = (stamp[1] if stamp else match["name"]) if evaluation else ""
        phase = "evaluation" if evaluation else "training"
        return Source(file, METRICS, _before(name, match), phase, stream, int(worker[1]) if worker else 0)
    if match := _COACH.search(name):
        return Source(file, METRICS, _before(name, match), "training")
    if match := _EPISODES.search(name):
        return Source(file, EPISODES, _before(name, match), "training", iteration=int(match["number"]))
    if match := _LOG.search(name):
        known = _PHASE.search(match["phase"] or "") or _PHASE.search(match["name"])
        word = known[1].lower() if known else None
        stream = match["name"] if word in ("evaluation", "leaderboard") else ""
        part = int(match["part"]) if match["part"] else None
        return Source(file, LOG, _before(name, match), word, stream, part=part)
    if match := _ABOUT.search(name):
        return Source(file, ABOUT, _before(name, match))
    return None


def _trace(name: str, file: str | MemberFile | GzippedFile, match: re.Match[str]) -> Source:
    root = _before(name, match)
    own = _OWN_FOLDER.search(root)
    stream = ""
    phase = match["phase"]
    if own:
        root = root[: own.start()]
        stream = own["stamp"] or own["long"] or ""
        phase = "leaderboard" if "leaderboard" in own[0] else phase
    worker = int(match["worker"]) if match["worker"] and phase == "training" else 0
    return Source(file, TRACE, root, phase, stream, worker, int(match["iteration"]))


def _bare_trace(name: str, file: str | MemberFile | GzippedFile, match: re.Match[str]) -> Source:
    """Return a trace outside its usual folder; the folders above the one that was named may tell."""
    root = name[: match.start()]
    whole = Path(file).resolve().as_posix() if isinstance(file, str) else str(file)
    if known := _TRACE.search(whole):
        return replace(_trace(whole, file, known), root=root)
    return Source(file, TRACE, root, None, iteration=int(match[1]))


def _single(path: Path) -> Source:
    """Return what one file is, by its ending and the folders it lies in."""
    file: str | GzippedFile = str(path)
    root = str(path)
    if path.name.endswith(PACKED):
        file, path = GzippedFile(path), path.with_suffix("")
    if path.suffix == ".json":
        return replace(_classified(f"metrics/{path.name}", file) or Source(file, METRICS, root), root=root, phase=None)
    if path.suffix == ".parquet":
        return Source(file, EPISODES, root, "training")
    if path.suffix == ".csv":
        single = Source(file, TRACE, root)
        if _is_coach(single):
            return replace(single, kind=METRICS)
        iteration = _ITERATION.search(path.name)
        return _bare_trace(path.name, file, iteration) if iteration else single
    return replace(_classified(path.name, file) or Source(file, LOG, root), kind=LOG, root=root, part=None)


def _is_coach(source: Source) -> bool:
    """Tell whether a CSV is the one that Coach kept of a training."""
    try:
        with source.open() as file:
            return file.read(len(_COACH_BEGINS)) == _COACH_BEGINS
    except OSError:
        return False


def _with_phases(found: list[Source]) -> list[Source]:
    """Return traces without a telling path as what the files beside them are, or as a training where they are several.

    An evaluation leaves one trace, number 0; a training one for each iteration.
    """
    named: dict[str, set[str]] = {}
    last: dict[str, int] = {}
    for source in found:
        if source.kind in (LOG, METRICS) and source.phase is not None:
            named.setdefault(source.root, set()).add(source.phase)
        elif source.kind == TRACE and source.phase is None:
            last[source.root] = max(last.get(source.root, 0), source.iteration)

    def phase_in(root: str) -> str | None:
        phases = named.get(root, set())
        return min(phases) if len(phases) == 1 else "training" if last[root] > 0 else None

    return [
        replace(source, phase=phase_in(source.root)) if source.kind == TRACE and source.phase is None else source
        for source in found
    ]


def _before(name: str, match: re.Match[str]) -> str:
    return name[: match.start("tail")]


def _without_doubles(found: list[Source], traces_first: bool) -> list[Source]:
    """Leave out what tells the same again: traces where our own episodes stand, or the other way round.

    Of logs whose rows stand in traces only what they say beside their rows is taken.
    """
    traced = {(source.root, source.phase) for source in found if source.kind == TRACE}
    ours = {source.root for source in found if source.kind == EPISODES and _is_ours(source, found)}
    if traces_first:
        ours -= {root for root, _ in traced}
    kept = []
    for source in found:
        if source.kind == LOG and ({(source.root, source.phase), (source.root, None)} & traced or source.root in ours):
            kept.append(replace(source, kind=ABOUT, phase=None, stream=""))
        elif source.kind == TRACE and source.phase == "training" and source.root in ours:
            continue
        elif source.kind != EPISODES or source.root in ours or len(found) == 1:
            kept.append(source)
    return kept


def _is_ours(episodes: Source, found: list[Source]) -> bool:
    """Tell whether a run of ours stands where these episodes lie."""
    for source in found:
        if source.kind == ABOUT and source.root == episodes.root and source.name.endswith(JOB):
            return json_object(source).get("format") == RUN_FORMAT
    return False


def json_object(source: Source) -> dict[str, Any]:
    """Return the object of a JSON file; an empty one where it holds none."""
    try:
        value = parse_json(source.read())
    except (ValueError, OSError):
        return {}
    return value if isinstance(value, dict) else {}


def _in_order(found: Iterable[Source]) -> list[Source]:
    """Return sources as they happened; each root, and each training of a root, is a round."""
    found = list(found)
    rounds: dict[tuple[str, str], int] = {}
    trainings = {(source.root, source.stream) for source in found if source.phase == "training"}
    for key in sorted(trainings | {(source.root, "") for source in found}, key=lambda key: _natural("/".join(key))):
        streams = [stream for root, stream in trainings if root == key[0]]
        if not key[1] and streams and "" not in streams:
            continue
        rounds[key] = len(rounds) + 1
    first = {root: min(number for (one, _), number in rounds.items() if one == root) for root, _ in rounds}
    numbered = []
    for source in found:
        number = rounds.get((source.root, source.stream)) if source.phase == "training" else None
        stream = "" if source.phase == "training" else source.stream
        numbered.append(source.placed(number or first[source.root], stream))
    timed = sorted(((_when(source), source) for source in numbered), key=itemgetter(0))
    return [one for _, same in itertools.groupby(timed, key=itemgetter(0)) for one in _by_name(same)]


def _by_name(timed: Iterable[tuple[Any, Source]]) -> list[Source]:
    """Return files that happened at the same time by their names; to part names costs more than all else, so late."""
    found = [source for _, source in timed]
    return sorted(found, key=lambda source: _natural(source.name)) if len(found) > 1 else found


def _when(source: Source) -> tuple[Any, ...]:
    order = {"training": 0, None: 0, "evaluation": 1, "leaderboard": 2}[source.phase]
    part = source.part if source.part is not None else 1 << 30
    return source.round, order, _natural(source.stream), source.iteration, source.worker, part


@lru_cache(maxsize=1024)
def _natural(name: str) -> list[tuple[int, int | str]]:
    """Return a key by which 2 comes before 10."""
    return [(0, int(part)) if part.isdigit() else (1, part) for part in re.split(r"(\d+)", name)]
