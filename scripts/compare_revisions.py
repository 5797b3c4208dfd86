"""Run the same commands with two revisions of racecraft and tell where what they leave is not alike, to the bit.

    python scripts/compare_revisions.py                        what HEAD leaves, beside what its parent leaves
    python scripts/compare_revisions.py v0.1 .                 the working tree beside a revision
    python scripts/compare_revisions.py HEAD HEAD              does anything vary by itself?
    python scripts/compare_revisions.py --only train snakes-train --keep out/kept
    python scripts/compare_revisions.py --list                 the scenarios and their commands

The source of each revision is laid out in a temporary folder, and each scenario runs twice side by side, in a folder of
its own, with a home of its own: no run, job, cache or setting of yours is read or written. What a command says and its
exit code are kept as files beside what it leaves, and all of them are compared. What is passed over stands in one
table below, by name and with its reason. Exit status: 0 alike, 1 something differs, 2 it could not be tried.

Kernels that a revision compiled are kept in out/likeness, so that only a revision that was never compared waits for
them. The commands run with the interpreter that runs this script: use that of .venv.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import re
import runpy
import shlex
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

ROOT = Path(__file__).resolve().parents[1]
KERNELS = ROOT / "out" / "likeness"
"""Compiled kernels, a folder for each source: not the program's own key, which is itself under comparison."""
PATIENCE_SECONDS = 600
TOLD, WIDTH = 8, 60
"""Files of a scenario that are told of, and characters of each side that are shown."""


@dataclass(frozen=True)
class Scenario:
    """Commands that are run one after the other in one folder."""

    name: str
    commands: tuple[str, ...]
    """The words behind `racecraft`; {traces} is the folder of recorded races."""
    after: str = ""
    """The scenario whose leavings this one begins with."""
    files: tuple[tuple[str, str], ...] = ()
    """Path and text of what lies there before."""
    loose: bool = False
    """Only exit codes count, not what is said."""
    still: bool = False
    """Before the first command the clocks in the runs are set to round figures, so that whole reports are alike."""


CAR, SNAKE, POLE = "runs/reinvent_base-1", "runs/snakes-1", "runs/CartPole-v1-1"
REWARD = '''def reward_function(params):
    """Pay for speed near the centre line."""
    return params["speed"] * (1.0 - params["distance_from_center"] / params["track_width"])
'''
METADATA = json.dumps(
    {
        "action_space": {"steering_angle": {"low": -30, "high": 30}, "speed": {"low": 1, "high": 2}},
        "sensor": ["FRONT_FACING_CAMERA"],
        "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
        "training_algorithm": "sac",
        "action_space_type": "continuous",
        "version": "5",
    }
)
HYPERPARAMETERS = json.dumps({"lr": 0.0003, "discount_factor": 0.98, "batch_size": 64})
CONTINUOUS_CAR = (
    ("my-car/reward_function.py", REWARD),
    ("my-car/model_metadata.json", METADATA),
    ("my-car/hyperparameters.json", HYPERPARAMETERS),
)

SCENARIOS = (
    Scenario("help", ("--help", "train --help", "snakes play --help"), loose=True),
    Scenario(
        "words",
        (
            "--version",
            "algorithms",
            "settings --json",
            "settings --world battlesnake --algorithm alphazero --json",
            "settings --world gymnasium --algorithm dqn --json",
            "explain lr",
            "train --track nowhere",
        ),
    ),
    Scenario("folders", ("new my-car", "init drfc", "settings drfc", "sensors my-car --at 0.3")),
    Scenario(
        "tracks", ("tracks list --json", "tracks show reinvent_base --picture reinvent.png", "tracks show Oval_track")
    ),
    Scenario("train", ("train --seed 1 --stop iterations=3",)),
    Scenario("resume", (f"train --run {CAR} --resume --stop iterations=5 --no-pictures",), after="train"),
    Scenario(
        "evaluate",
        (
            f"evaluate {CAR} --json",
            f"evaluate {CAR} --checkpoint last --number-of-trials 2 --max-resets 3 --json",
            f"evaluate {CAR} --track Oval_track --laps 2 --picture oval.png --json",
            f"evaluate {CAR} --under strong --tries 2",
        ),
        after="train",
    ),
    Scenario("race", (f"race {CAR}:last {CAR}:0 --races 2 --laps 1 --max-resets 5 --json",), after="train"),
    Scenario(
        "read",
        (
            f"why {CAR} --starts 4 --checkpoints 2 --json",
            f"checkpoints {CAR} --json",
            f"logs {CAR} --json",
            "notebooks notebooks",
        ),
        after="train",
    ),
    Scenario("report", (f"report {CAR} --json",), after="train", still=True),
    Scenario("look", (f"look {CAR} --json",), after="train"),
    Scenario(
        "hand-on",
        (
            f"export {CAR} --to onnx",
            f"export {CAR} --to car --output car.tar.gz",
            "import car.tar.gz runs/imported --track reinvent_base --json",
            "evaluate runs/imported --laps 1 --json",
            f"record {CAR} --episodes 2",
        ),
        after="train",
    ),
    Scenario(
        "train-continuous",
        ("train my-car --seed 2 --stop iterations=2 --set rollout.num_worlds=8 --no-pictures",),
        files=CONTINUOUS_CAR,
    ),
    Scenario(
        "train-aws",
        ("train --preset aws --seed 3 --stop iterations=1 --set rollout.episodes_per_iteration=2 --no-pictures",),
    ),
    Scenario(
        "train-boxes",
        (
            "train --seed 4 --stop iterations=2 --set race.type=OBJECT_AVOIDANCE --set variation.level=strong "
            "--tracks Oval_track,reinvent_base --no-pictures",
            "train --seed 4 --stop iterations=2 --set race.type=HEAD_TO_BOT --no-pictures",
        ),
    ),
    Scenario(
        "logs",
        (
            "logs {traces}/drfc-1-worker --parquet worker.parquet --json",
            "logs {traces}/droa-2026-discrete --page discrete.html --csv discrete.csv --track reinvent_base",
            "replay {traces}/drfc-1-worker/evaluation-20220709200242 --track reinvent_base --picture replay.png --json",
        ),
    ),
    Scenario(
        "snakes-train",
        (
            "snakes train --seed 1 --size 7 --snakes 2 --stop iterations=2 --set rollout.num_worlds=32",
            f"evaluate {SNAKE} --episodes 10 --json",
        ),
    ),
    Scenario("snakes-report", (f"report {SNAKE} --json",), after="snakes-train", still=True),
    Scenario(
        "snakes-play",
        (
            "snakes players",
            "snakes play flood_fill area_control --seed 3 --timeout 5000 --output game.jsonl",
            "snakes verify game.jsonl --json",
            "snakes film game.jsonl",
            "snakes tournament flood_fill hungry random_safe --rounds 2 --seed 5 --timeout 5000 --file games.jsonl",
        ),
    ),
    Scenario("gym-ppo", ("gym train CartPole-v1 --stop iterations=3", f"evaluate {POLE} --episodes 5 --json")),
    Scenario("gym-report", (f"report {POLE} --json",), after="gym-ppo", still=True),
    Scenario("gym-dqn", ("gym train CartPole-v1 --algorithm dqn --stop steps=3000 --no-pictures",)),
    Scenario(
        "gym-simple",
        (
            "gym train CartPole-v1 --algorithm reinforce --stop iterations=2 --no-pictures",
            "gym train CartPole-v1 --algorithm es --stop iterations=2 --no-pictures",
            "gym train Pendulum-v1 --algorithm sac --stop steps=1500 --no-pictures",
        ),
    ),
    Scenario("unity", ("unity train builtin:Basic --seed 1 --stop iterations=2", "export runs/Basic-1 --to unity")),
)

PASSED_OVER = (
    ("*metrics.jsonl", r"\d+\.(seconds(_\w+)?|steps_per_second)", "how long an iteration took"),
    ("*job.json", r"started|versions\..*|machine\..*", "when and where it ran"),
    ("*deepracer_checkpoints.json", r"\w+\.time_stamp", "when a checkpoint was written"),
    ("*game.jsonl", r".*\.latency", "how long a snake thought, ms"),
    (
        "*.state.safetensors",
        r"digest|card\.loop\.seconds\w*|card\.aws\.marks\.\w+\.time_stamp",
        "clocks and their hash",
    ),
)
"""File, values in it, reason: what differs between two runs of one revision."""
DRAWN_OVER_TIME = ("curves.png", "report.html")
"""Their axes are wall-clock seconds; the report with all curves is compared where clocks stand still."""
PLACEHOLDERS = (
    (r"evaluation-\d{14}", "evaluation-MOMENT"),
    (r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?(\.\d+)?Z?", "MOMENT"),
    (r"(?<=\| )[\d.]+ (s|min|h)(?= \|)", "SECONDS"),
    (r"(?<=It took )[\d.]+ (s|min)|(?<=steps and )[\d.]+ (s|min)", "SECONDS"),
    (r"[\d,.]+ steps/s", "SPEED"),
    (r"(?s)<h2>Why it fails</h2>.*?(?=<h2>)", "WHY\n"),  # of as many cures as time allows; `why` is compared by itself
    (r"First run on this machine: .*\n", ""),
    (r"\b[mp][0-9a-f]{10}\b", "ID"),  # Matplotlib draws lots for the names in an SVG
)


@dataclass(frozen=True)
class Side:
    """A revision that is laid out and run."""

    name: str
    source: Path
    """The folder `src` of the revision."""
    place: Path
    """What it leaves: a folder for each scenario."""
    kernels: Path

    @property
    def environment(self) -> dict[str, str]:
        """The variables of its commands: nothing of the user's is told."""
        foreign = ("RACECRAFT_", "DR_", "AWS_", "XDG_", "NUMBA_", "PYTHON")
        kept = {name: value for name, value in os.environ.items() if not name.startswith(foreign)}
        own = {"HOME": self.place / "home", "PYTHONPATH": self.source, "RACECRAFT_CACHE": self.kernels}
        plain = {
            "COLUMNS": "120",
            "OMP_WAIT_POLICY": "PASSIVE",
            "TERM": "dumb",
            "NO_COLOR": "1",
            "MPLBACKEND": "agg",
            "TZ": "UTC",
        }
        return {**kept, **plain, **{name: str(path) for name, path in own.items()}}


def main() -> int:
    """Lay both revisions out, run every scenario with both, compare."""
    options = read_options()
    chosen = chosen_scenarios(options.only)
    if options.list:
        print("\n".join(f"{one.name}\n    " + "\n    ".join(one.commands) for one in chosen))
        return 0
    with working_folder(options.keep) as folder:
        try:
            old = lay_out(options.old, folder / "old")
            new = lay_out(options.new, folder / "new")
        except subprocess.CalledProcessError as error:
            print(f"{options.old}, {options.new}: {(error.stderr or b'').decode().strip() or error}", file=sys.stderr)
            return 2
        differing = [one.name for one in chosen if not is_alike(one, old, new)]
    print(f"{len(chosen) - len(differing)} of {len(chosen)} scenarios leave the same", end="")
    print(f"; these differ: {', '.join(differing)}" if differing else "")
    return 1 if differing else 0


def read_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("old", nargs="?", default="HEAD^", help="a revision; HEAD^ where nobody says")
    parser.add_argument("new", nargs="?", default="HEAD", help="a revision, or . for the working tree; HEAD")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these scenarios, and what they follow")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="a new folder that keeps what both leave")
    parser.add_argument("--list", action="store_true", help="list the scenarios and stop")
    options = parser.parse_args()
    if unknown := set(options.only) - {one.name for one in SCENARIOS}:
        parser.error(f"no scenario is called {', '.join(sorted(unknown))}; --list tells their names")
    if options.keep and options.keep.exists():
        parser.error(f"{options.keep} is there already; --keep makes a new folder")
    return options


def chosen_scenarios(names: list[str]) -> list[Scenario]:
    """Return the scenarios of these names, and those they begin with; all where no name is given."""
    wanted = set(names) or {one.name for one in SCENARIOS}
    wanted |= {one.after for one in SCENARIOS if one.name in wanted}
    return [one for one in SCENARIOS if one.name in wanted]


@contextlib.contextmanager
def working_folder(keep: Path | None) -> Iterator[Path]:
    """Give a folder to work in; it goes at the end, whatever ends it, unless it shall be kept."""
    if keep:
        keep.mkdir(parents=True)
        yield keep.resolve()
    else:
        with tempfile.TemporaryDirectory(prefix="likeness-", ignore_cleanup_errors=True) as folder:
            yield Path(folder).resolve()


def lay_out(revision: str, place: Path) -> Side:
    """Lay the source of a revision out, and see that it is what runs."""
    tree = git("rev-parse", "--verify", f"{snapshot(place) if revision == '.' else revision}:src").decode().strip()
    (place / "home").mkdir(parents=True)
    with tarfile.open(fileobj=io.BytesIO(git("archive", "--prefix=src/", tree))) as files:
        files.extractall(place, filter="data")
    side = Side(revision, place / "src", place, KERNELS / tree[:12])
    code = "import racecraft; print(racecraft.__file__)"
    ran = subprocess.run([sys.executable, "-c", code], env=side.environment, capture_output=True, check=True).stdout
    if not Path(ran.decode().strip()).resolve().is_relative_to(side.source):
        raise SystemExit(f"{revision}: {ran.decode().strip()} runs instead of what lies in {side.source}")
    return side


def snapshot(place: Path) -> str:
    """Return the tree of the working tree as it is now; what git ignores is not in it."""
    place.mkdir(parents=True)
    index = {"GIT_INDEX_FILE": str(place / "index")}
    git("read-tree", "HEAD", **index)
    git("add", "--all", **index)
    return git("write-tree", **index).decode().strip()


def git(*words: str, **variables: str) -> bytes:
    """Ask git about this repository."""
    command = ["git", "-C", str(ROOT), *words]
    return subprocess.run(command, env={**os.environ, **variables}, capture_output=True, check=True).stdout


def is_alike(scenario: Scenario, old: Side, new: Side) -> bool:
    """Run a scenario with both sides, compare what they leave, and tell."""
    print(f"{scenario.name:17}", end="", flush=True)
    began = time.monotonic()
    run_beside(scenario, (old, new))
    found = list(differences(scenario, old, new))
    seconds = f"{time.monotonic() - began:5.1f} s"
    if not found:
        count = sum(path.is_file() for path in (old.place / scenario.name).rglob("*"))
        print(f"{seconds}  same, {count} files{failed(old.place / scenario.name)}", flush=True)
        return True
    print(f"{seconds}  differs:")
    print("\n".join(f"    {one}" for one in found[:TOLD]))
    if len(found) > TOLD:
        print(f"    and {len(found) - TOLD} more files")
    sys.stdout.flush()
    return False


def failed(folder: Path) -> str:
    """Return which commands of a scenario ended with another exit code than 0: alike in that, but worth a look."""
    codes = {path.stem: path.read_text().strip() for path in sorted(folder.glob("said/*.exit"))}
    told = ", ".join(f"{name} {code}" for name, code in codes.items() if code != "0")
    return f" (exit codes: {told})" if told else ""


def run_beside(scenario: Scenario, sides: tuple[Side, Side]) -> None:
    """Run the commands with both sides at once, one command after the other; keep what they say."""
    for side in sides:
        prepare(scenario, side)
    for number, command in enumerate(scenario.commands, 1):
        traces = runpy.run_path(str(ROOT / "tests" / "reference.py"))["TRACES"] if "{traces}" in command else ""
        words = shlex.split(command.format(traces=traces))
        name = f"{number}-{words[0].lstrip('-')}"
        with contextlib.ExitStack() as stack:
            running = [stack.enter_context(started(side, scenario, words, name)) for side in sides]
            codes = [process.wait(PATIENCE_SECONDS) for process in running]
        for side, code in zip(sides, codes, strict=True):
            (said(side, scenario) / f"{name}.exit").write_text(f"{code}\n")
    if scenario.loose:
        for side in sides:
            for path in [*said(side, scenario).glob("*.out"), *said(side, scenario).glob("*.err")]:
                path.unlink()


def prepare(scenario: Scenario, side: Side) -> None:
    """Make the folder that a scenario runs in."""
    here = side.place / scenario.name / "left"
    if scenario.after:
        shutil.copytree(side.place / scenario.after / "left", here)
    for path, text in scenario.files:
        (here / path).parent.mkdir(parents=True, exist_ok=True)
        (here / path).write_text(text)
    here.mkdir(parents=True, exist_ok=True)
    said(side, scenario).mkdir()
    if scenario.still:
        still_clocks(here)


def said(side: Side, scenario: Scenario) -> Path:
    """Return the folder of what the commands say."""
    return side.place / scenario.name / "said"


def still_clocks(folder: Path) -> None:
    """Set what runs say of time to round figures, and take away what was drawn over it."""
    for path in [path for name in DRAWN_OVER_TIME for path in folder.rglob(name)]:
        path.unlink()
    for path in folder.rglob("metrics.jsonl"):
        rows = [json.loads(line) for line in path.read_text().splitlines()]
        for row in rows:
            spans = dict.fromkeys((key for key in row if key.startswith("seconds")), 0.0)
            row.update(spans, seconds=float(row["iteration"]), steps_per_second=1000.0)
        path.write_text("".join(json.dumps(row) + "\n" for row in rows))
    for path in folder.rglob("job.json"):
        path.write_text(json.dumps({**json.loads(path.read_text()), "started": "2026-01-01T00:00:00Z"}))


@contextlib.contextmanager
def started(side: Side, scenario: Scenario, words: list[str], name: str) -> Iterator[subprocess.Popen[bytes]]:
    """Begin a command; at the end it is over, even if the end is Ctrl-C."""
    here, told = side.place / scenario.name / "left", said(side, scenario) / name
    command = [sys.executable, "-m", "racecraft", *words]
    with open(f"{told}.out", "wb") as out, open(f"{told}.err", "wb") as err:
        process = subprocess.Popen(
            command, cwd=here, env=side.environment, stdin=subprocess.DEVNULL, stdout=out, stderr=err
        )
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGKILL)
                process.wait()


def differences(scenario: Scenario, old: Side, new: Side) -> Iterator[str]:
    """Yield what two sides left that is not alike: files of one side first, then the first value of each other file."""
    mine, theirs = (files_of(side.place / scenario.name, side) for side in (old, new))
    for name in sorted(mine.keys() ^ theirs.keys()):
        yield f"{name}: only the {'old' if name in mine else 'new'} one leaves it"
    for name in sorted(mine.keys() & theirs.keys()):
        if scenario.still or Path(name).name not in DRAWN_OVER_TIME:
            found = list(unlike(name, contents(mine[name], old), contents(theirs[name], new)))
            more = f", and {len(found) - 1} more" if len(found) > 1 else ""
            yield from (f"{name}: {what}{more}" for what in found[:1])


def files_of(folder: Path, side: Side) -> dict[str, Path]:
    """Return the files of a folder by their names with placeholders."""
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {plain(path.relative_to(folder).as_posix(), side): path for path in paths}


def unlike(name: str, old: dict[str, Any], new: dict[str, Any]) -> Iterator[str]:
    """Yield where the values of two files differ, and how."""
    expected = [pattern for file, pattern, _ in PASSED_OVER if Path(name).match(file)]
    for place in [*old, *(place for place in new if place not in old)]:
        if any(re.fullmatch(pattern, place) for pattern in expected):
            continue
        if place not in old or place not in new:
            yield f"{place} ({', '.join(shown(one[place]) if place in one else 'absent' for one in (old, new))})"
        elif fingerprint(old[place]) != fingerprint(new[place]):
            yield f"{place} {pair(old[place], new[place])}"


def fingerprint(value: Any) -> Any:
    """Return what is equal for equal bits: -0.0 is not 0.0, 1 is not 1.0, and a NaN is itself."""
    return (value.dtype.str, value.shape, value.tobytes()) if isinstance(value, np.ndarray) else repr(value)


def pair(old: Any, new: Any) -> str:
    """Return the first difference of two values as (old, new)."""
    if isinstance(old, np.ndarray) and isinstance(new, np.ndarray):
        if (old.dtype, old.shape) != (new.dtype, new.shape):
            return f"({old.dtype} {old.shape}, {new.dtype} {new.shape})"
        rows = [
            one.reshape(-1, 1).view(np.uint8).reshape(one.size, -1) for one in map(np.ascontiguousarray, (old, new))
        ]
        places = np.flatnonzero((rows[0] != rows[1]).any(axis=1))
        first = places[0]
        return f"{len(places)} of {old.size} values, first [{first}] ({old.flat[first]!r}, {new.flat[first]!r})"
    begins = 0
    if isinstance(old, str) and isinstance(new, str):
        begins = max(0, len(os.path.commonprefix([old, new])) - WIDTH // 3)
    return f"({shown(old, begins)}, {shown(new, begins)})"


def shown(value: Any, begins: int = 0) -> str:
    """Return a value in a few characters."""
    told = f"{'…' if begins else ''}{value[begins:]}" if isinstance(value, str) else repr(value)
    return told if len(told) <= WIDTH else f"{told[:WIDTH]}…"


def contents(path: Path, side: Side) -> dict[str, Any]:
    """Return what is in a file: values by their place."""
    ending = ".tar.gz" if path.name.endswith(".tar.gz") else path.suffix
    return READERS.get(ending, read_text)(path.read_bytes(), side)


def read_text(data: bytes, side: Side) -> dict[str, Any]:
    """Lines by their number, with placeholders; of what is no text, all bytes."""
    try:
        lines = plain(data.decode(), side).split("\n")
    except UnicodeDecodeError:
        return read_bytes(data, side)
    return {f"line {number}": line for number, line in enumerate(lines, 1)}


def read_bytes(data: bytes, side: Side) -> dict[str, Any]:
    """All bytes as one array."""
    return {"bytes": np.frombuffer(data, np.uint8)}


def read_json(data: bytes, side: Side) -> dict[str, Any]:
    """Values by their path."""
    return dict(flat(json.loads(plain(data.decode(), side))))


def read_json_lines(data: bytes, side: Side) -> dict[str, Any]:
    """Values by line and path."""
    return dict(flat([json.loads(line) for line in plain(data.decode(), side).splitlines()]))


def read_safetensors(data: bytes, side: Side) -> dict[str, Any]:
    """Tensors by name, and what stands in the header."""
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    told = header.pop("__metadata__", {})
    body = data[8 + int.from_bytes(data[:8], "little") :]
    tensors = {}
    for name, tensor in header.items():
        begin, end = tensor["data_offsets"]
        tensors[name] = np.frombuffer(body[begin:end], TENSOR_DTYPES[tensor["dtype"]]).reshape(tensor["shape"])
    words = {key: json.loads(text) if text.startswith(("{", "[")) else text for key, text in told.items()}
    return {**dict(flat(words)), **tensors}


def read_parquet(data: bytes, side: Side) -> dict[str, Any]:
    """Columns by name."""
    table = pl.read_parquet(io.BytesIO(data))
    return {column.name: column_values(column) for column in table}


def column_values(column: pl.Series) -> np.ndarray:
    """Return numbers as they are, anything else, and what has gaps, as it is written."""
    if column.dtype.is_numeric() and not column.null_count():
        return column.to_numpy()
    return np.array([f"{column.dtype} {value!r}" for value in column], dtype=np.str_)


def read_tar(data: bytes, side: Side) -> dict[str, Any]:
    """Bytes by the members' names, without the times of packing."""
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        members = [(member.name, archive.extractfile(member)) for member in archive if member.isfile()]
        return {name: np.frombuffer(file.read(), np.uint8) for name, file in members if file}


def flat(value: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the leaves of nested lists and objects by their path; keys keep their order."""
    branches = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
    if not branches:
        yield place, value
        return
    for key, inner in branches:
        yield from flat(inner, f"{place}.{key}" if place else str(key))


def plain(text: str, side: Side) -> str:
    """Return a text with placeholders for folders and moments."""
    text = text.replace(str(side.place), "PLACE").replace(str(side.kernels), "KERNELS")
    for pattern, word in PLACEHOLDERS:
        text = re.sub(pattern, word, text)
    return text


TENSOR_DTYPES = {
    **{f"{kind}{8 * size}": f"<{kind.lower()}{size}" for kind in "IF" for size in (2, 4, 8)},
    **{f"U{8 * size}": f"<u{size}" for size in (1, 2, 4, 8)},
    "I8": "<i1",
    "BOOL": "?",
    "BF16": "<u2",
}
READERS: dict[str, Callable[[bytes, Side], dict[str, Any]]] = {
    ".json": read_json,
    ".jsonl": read_json_lines,
    ".safetensors": read_safetensors,
    ".parquet": read_parquet,
    ".tar.gz": read_tar,
    **dict.fromkeys((".png", ".mp4", ".npy", ".onnx"), read_bytes),
}
"""How a file is read by its ending; any other is read as text, or as bytes where it is none."""


if __name__ == "__main__":
    try:
        raise SystemExit(main())
    except KeyboardInterrupt:
        raise SystemExit(130) from None
