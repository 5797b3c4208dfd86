"""Weights of a policy, and the whole state of a trainer, as safetensors: nothing in them can run code.

Begin with `Checkpoints`, the shelf in a run folder: `save`, then `find("best")`, `find("last")` or `find("12")`. The
files by themselves are written and read by `save_policy`, `load_policy`, `save_state`, `load_state`.

    checkpoints.json         which there are, which is best, which is last
    <N>.policy.safetensors   weights after iteration N; its card (iteration, steps, how to build the network) within
    <N>.state.safetensors    all that is needed to go on as if nothing had happened; kept for the last two only

Here are NumPy arrays; whoever has torch tensors converts them. How they lie in a file is `tensor_file.py`'s affair.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import ContractError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import parse_json
from racecraft.formats.tensor_file import CheckpointError, read_card, read_tensors, write_tensors
from racecraft.formats.user_file import read_regular

VERSION = 1
INDEX = "checkpoints.json"
POLICY_SUFFIX, STATE_SUFFIX = ".policy.safetensors", ".state.safetensors"
BEST, LAST = "best", "last"
IMPORTED = "imported"
"""Key of a run that was imported from another program: job.json says from where, a checkpoint what it lacks."""
STATES_KEPT = 2
WEIGHTS_BUDGET_BYTES = 4 * 10**9
"""Weights of one run take at most so much: ten thousand small networks, or eighty of AWS's size (47 MB each)."""

_POLICY = "racecraft policy"
_STATE = "racecraft trainer state"


@dataclass(frozen=True)
class CheckpointEntry:
    """One checkpoint."""

    iteration: int
    """Iteration after which it was taken, counted from 0."""
    steps: int
    """Steps of experience it has learned from."""
    score: float | None
    """What the evaluation gave it; None where there was none."""
    policy: str
    """Name of the file with the weights."""
    state: str | None
    """Name of the file with the trainer's state; None where it was not kept."""


def save_policy(path: str | Path, weights: Mapping[str, Array], card: Mapping[str, Any]) -> None:
    """Write the weights of a policy.

    Args:
        path: Where to.
        weights: Arrays by name, of any number type.
        card: What a stranger needs to use them, as plain JSON values: iteration, steps, spec of the network.

    Raises:
        OutputFileError: The file cannot be written.
    """
    write_tensors(path, _POLICY, weights, dict(card))


def load_policy(path: str | Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return the weights and the card.

    Raises:
        CheckpointError: The file is missing, damaged, or no policy.
    """
    return read_tensors(Path(path), _POLICY)


def save_state(path: str | Path, state: Mapping[str, Any]) -> None:
    """Write a trainer's whole state: dictionaries, lists and tuples of arrays, numbers, texts, booleans and None.

    Raises:
        OutputFileError: The file cannot be written.
        ContractError: Something in the state is none of these; the message says where.
    """
    arrays: dict[str, Array] = {}
    tree = _folded(state, "state", arrays)
    write_tensors(path, _STATE, arrays, tree)


def load_state(path: str | Path) -> dict[str, Any]:
    """Return a trainer's state just as it was saved, types of numbers included.

    Raises:
        CheckpointError: The file is missing, damaged, or no trainer's state.
    """
    arrays, tree = read_tensors(Path(path), _STATE)
    state: dict[str, Any] = _unfolded(tree, arrays)
    return state


class Checkpoints:
    """The checkpoints of a run folder. The index is written whole, after the files it names.

    Args:
        folder: Where it stands.
        weights_budget: Bytes that all weights together may take; beyond it the oldest are taken away.
        keep_every: Only the weights of every so many iterations stay, beside those that always do.
        keep_count: So many of them at most, spread over the training; None: all.
    """

    def __init__(
        self,
        folder: str | Path,
        weights_budget: int = WEIGHTS_BUDGET_BYTES,
        keep_every: int = 1,
        keep_count: int | None = None,
    ) -> None:
        self.folder, self._weights_budget = Path(folder), weights_budget
        self._keep_every, self._keep_count = keep_every, keep_count
        self._rebuilt: dict[str, Any] | None = None

    def save(
        self,
        iteration: int,
        steps: int,
        weights: Mapping[str, Array],
        card: Mapping[str, Any],
        state: Mapping[str, Any] | None = None,
        score: float | None = None,
        best: bool = False,
    ) -> CheckpointEntry:
        """Save a checkpoint; it is the last from now on, and the best if `best` says so.

        Older states than those of the last two are taken away. So are weights between those that are kept, and the
        oldest once all of them together are too large, but never the untrained, the best and the last two.

        Raises:
            OutputFileError: A file cannot be written; the folder is then as it was.
        """
        index = self._index()
        policy = f"{iteration}{POLICY_SUFFIX}"
        save_policy(self.folder / policy, weights, {**card, "iteration": iteration, "steps": steps})
        state_name = None
        if state is not None:
            state_name = f"{iteration}{STATE_SUFFIX}"
            save_state(self.folder / state_name, state)
        entry = CheckpointEntry(iteration, steps, score, policy, state_name)
        entries = [old for old in index["checkpoints"] if old["iteration"] != iteration] + [asdict(entry)]
        entries.sort(key=lambda old: int(old["iteration"]))
        gone = _states_to_drop(entries)
        best_iteration = iteration if best else index["best"]
        gone += self._weights_to_drop(entries, iteration if best_iteration is None else best_iteration)
        self._write_index({"version": VERSION, "best": best_iteration, "last": iteration, "checkpoints": entries})
        for name in gone:
            (self.folder / name).unlink(missing_ok=True)
        return entry

    def mark(
        self, iteration: int, score: float | None, *, best: bool = False, state: Mapping[str, Any] | None = None
    ) -> None:
        """Note what a checkpoint that stands was found to be worth after it was saved.

        Args:
            iteration: Which.
            score: What the evaluation gave it.
            best: Whether it is the best from now on.
            state: Parts of the trainer's state as they are now, by name; they take the place of those it was saved
                with, where it was kept.

        Raises:
            CheckpointError: There is no such checkpoint.
            OutputFileError: A file cannot be written.
        """
        entry = self.find(str(iteration))
        if state is not None and entry.state is not None:
            save_state(self.folder / entry.state, {**load_state(self.folder / entry.state), **state})
        index = self._index()
        for one in index["checkpoints"]:
            if one["iteration"] == iteration:
                one["score"] = score
        self._write_index({**index, "best": iteration if best else index["best"]})

    def prune(self) -> int:
        """Take away what `save` would, without a new checkpoint; return the bytes that are free now.

        Raises:
            CheckpointError: The index is damaged.
            OutputFileError: It cannot be written; everything stands then.
        """
        index = self._index()
        if not index["checkpoints"]:
            return 0
        gone = self._weights_to_drop(index["checkpoints"], index["best"] if _is_evaluated(index) else index["last"])
        freed = sum(map(self._size, gone))
        self._write_index(index)
        for name in gone:
            (self.folder / name).unlink(missing_ok=True)
        return freed

    def entries(self) -> list[CheckpointEntry]:
        """Return all checkpoints, by iteration.

        Raises:
            CheckpointError: The index is damaged.
        """
        return [CheckpointEntry(**entry) for entry in self._index()["checkpoints"]]

    def find(self, which: str) -> CheckpointEntry:
        """Return the checkpoint called "best", "last", or by the number of its iteration.

        Before any was evaluated, the last is the best that is known: what was trained, not what it began with.

        Raises:
            CheckpointError: There is no such checkpoint, or the index is damaged.
        """
        index = self._index()
        wanted = str(index[which]) if which in (BEST, LAST) else which
        if which == BEST and not _is_evaluated(index):
            wanted = str(index["last"])
        for entry in index["checkpoints"]:
            if str(entry["iteration"]) == wanted:
                return CheckpointEntry(**entry)
        there = _in_rows([int(entry["iteration"]) for entry in index["checkpoints"]]) or "none yet"
        raise CheckpointError(
            self.folder,
            Message("there is no checkpoint '{which}'", which=which),
            Message("best, last, or one of the iterations: {there}", there=there),
        )

    def load_policy(self, which: str) -> tuple[dict[str, Array], dict[str, Any]]:
        """Return weights and card of the checkpoint called `which`.

        Raises:
            CheckpointError: There is no such checkpoint, or it is damaged.
        """
        return load_policy(self.folder / self.find(which).policy)

    def read_card(self, which: str) -> dict[str, Any]:
        """Return the card of the checkpoint called `which`; its weights are not read.

        Raises:
            CheckpointError: There is no such checkpoint, or its head is damaged.
        """
        card: dict[str, Any] = read_card(self.folder / self.find(which).policy, _POLICY)
        return card

    def load_state(self, which: str = "last") -> dict[str, Any]:
        """Return the trainer's state of the checkpoint called `which`.

        Raises:
            CheckpointError: There is no such checkpoint, its state was not kept, or it is damaged.
        """
        entry = self.find(which)
        if entry.state is None:
            kept = _in_rows([other.iteration for other in self.entries() if other.state]) or "none"
            raise CheckpointError(
                self.folder,
                Message("the state of checkpoint {iteration} was not kept", iteration=entry.iteration),
                Message("one of the iterations: {kept}", kept=kept),
                "Its weights can still begin a new training.",
            )
        return load_state(self.folder / entry.state)

    def _weights_to_drop(self, entries: list[dict[str, Any]], best: int) -> list[str]:
        """Take the oldest entries out, in place, until the weights keep the budget; return the names of their files."""
        sizes = {entry["policy"]: self._size(entry["policy"]) for entry in entries}
        spared = {0, best, *(entry["iteration"] for entry in entries[-STATES_KEPT:])}
        total, gone = sum(sizes.values()), []
        for entry in [entry for entry in entries if entry["iteration"] not in spared]:
            is_between = entry["iteration"] % self._keep_every != 0
            if not is_between and total <= self._weights_budget:
                continue
            entries.remove(entry)
            total -= sizes[entry["policy"]]
            gone.append(entry["policy"])
        if self._keep_count is not None:
            gone += _thinned(entries, spared, self._keep_count)
        return gone

    def _size(self, name: str) -> int:
        try:
            return (self.folder / name).stat().st_size
        except OSError:
            return 0  # somebody took it away

    def _index(self) -> dict[str, Any]:
        path = self.folder / INDEX
        try:
            index = parse_json(read_regular(path).decode())
            known = index["version"] == VERSION and {"best", "last", "checkpoints"} <= set(index)
            if known and not all(isinstance(entry["iteration"], int) for entry in index["checkpoints"]):
                raise ValueError("an iteration is no whole number")
        except OSError as error:
            if isinstance(error, FileNotFoundError):
                return self._index_of_files()
            raise CheckpointError(
                path, Message("cannot be read ({strerror})", strerror=error.strerror), "the index that racecraft wrote"
            ) from error
        except (ValueError, KeyError, TypeError) as error:
            rebuilt = self._index_of_files()
            if rebuilt["checkpoints"]:
                return rebuilt
            raise CheckpointError(
                path, Message("damaged ({error})", error=error), "the index that racecraft wrote"
            ) from error
        if not known:
            raise CheckpointError(
                path,
                Message("version is {index!r}", index=index["version"]),
                Message("version {version}", version=VERSION),
                "Upgrade racecraft.",
            )
        return dict(index)

    def _index_of_files(self) -> dict[str, Any]:
        """Return an index of the whole files in the folder; scores, and which is best, are not known.

        Read once: the next `save` writes an index again.
        """
        if self._rebuilt is None:
            entries = [entry for file in self.folder.glob(f"*{POLICY_SUFFIX}") if (entry := self._entry_of(file))]
            entries.sort(key=lambda entry: entry.iteration)
            states = [entry.iteration for entry in entries if entry.state is not None]
            last = states[-1] if states else entries[-1].iteration if entries else None
            self._rebuilt = {
                "version": VERSION,
                "best": None,
                "last": last,
                "checkpoints": [asdict(entry) for entry in entries],
            }
        return self._rebuilt

    def _entry_of(self, policy: Path) -> CheckpointEntry | None:
        """Return the checkpoint of a file with weights; None where it is not whole."""
        state = policy.with_name(policy.name.removesuffix(POLICY_SUFFIX) + STATE_SUFFIX)
        try:
            _, card = load_policy(policy)
            iteration, steps = int(card["iteration"]), int(card["steps"])
        except (CheckpointError, KeyError, TypeError, ValueError):
            return None
        try:
            load_state(state)
        except CheckpointError:
            return CheckpointEntry(iteration, steps, None, policy.name, None)
        return CheckpointEntry(iteration, steps, None, policy.name, state.name)

    def _write_index(self, index: Mapping[str, Any]) -> None:
        write_atomic(self.folder / INDEX, json.dumps(index, indent=2) + "\n")
        self._rebuilt = None


def _is_evaluated(index: Mapping[str, Any]) -> bool:
    """Tell whether an evaluation has called one the best; older runs called the untrained so before any did."""
    return index["best"] is not None and not any(
        one["iteration"] == index["best"] == 0 and one["score"] is None for one in index["checkpoints"]
    )


def _thinned(entries: list[dict[str, Any]], spared: set[int], count: int) -> list[str]:
    """Take entries out, in place, until so many stay besides the spared; return the names of their files.

    What was never evaluated goes first: nothing can be ranked by it. Of three neighbours the middle one goes whose
    outer two are nearest to each other, so that what stays is spread.
    """
    gone: list[str] = []
    while len(free := [at for at, entry in enumerate(entries) if entry["iteration"] not in spared]) > count:
        closest = min(
            free,
            key=lambda at: (
                entries[at]["score"] is not None,
                entries[at + 1]["iteration"] - entries[at - 1]["iteration"],
            ),
        )
        gone.append(entries.pop(closest)["policy"])
    return gone


def _states_to_drop(entries: list[dict[str, Any]]) -> list[str]:
    """Take the states before the last two out of the entries, in place; return the names of their files."""
    with_state = [entry for entry in entries if entry["state"]]
    gone = [str(entry["state"]) for entry in with_state[:-STATES_KEPT]]
    for entry in with_state[:-STATES_KEPT]:
        entry["state"] = None
    return gone


def _folded(value: Any, place: str, arrays: dict[str, Array]) -> Any:
    """Return the value as JSON, with each array moved to `arrays` and named by its place."""
    if value is None or isinstance(value, bool | int | float | str) and not isinstance(value, np.generic):
        return value
    if isinstance(value, np.ndarray | np.generic):
        if value.dtype.kind not in "biuf":
            raise ContractError(
                "{place} is an array of {dtype}; a checkpoint holds numbers and booleans.",
                place=place,
                dtype=value.dtype,
            )
        name = place if place not in arrays else f"{place}#{len(arrays)}"  # "a.b" may be one key or two
        arrays[name] = np.asarray(value)
        return {"$array" if isinstance(value, np.ndarray) else "$number": name}
    if isinstance(value, Mapping):
        if all(isinstance(key, str) and not key.startswith("$") for key in value):
            return {key: _folded(part, f"{place}.{key}", arrays) for key, part in value.items()}
        pairs = [[_folded(key, place, arrays), _folded(part, f"{place}.{key}", arrays)] for key, part in value.items()]
        return {"$pairs": pairs}
    if isinstance(value, list | tuple):
        parts = [_folded(part, f"{place}.{number}", arrays) for number, part in enumerate(value)]
        return parts if isinstance(value, list) else {"$tuple": parts}
    raise ContractError(
        "{place} is of type {type_name}; a checkpoint holds arrays, numbers, texts, booleans, None, "
        "and dictionaries, lists and tuples of them. Convert it before saving.",
        place=place,
        type_name=type(value).__name__,
    )


def _unfolded(tree: Any, arrays: Mapping[str, Array]) -> Any:
    if isinstance(tree, list):
        return [_unfolded(part, arrays) for part in tree]
    if not isinstance(tree, dict):
        return tree
    if "$array" in tree:
        return arrays[tree["$array"]]
    if "$number" in tree:
        return arrays[tree["$number"]][()]
    if "$tuple" in tree:
        return tuple(_unfolded(part, arrays) for part in tree["$tuple"])
    if "$pairs" in tree:
        return {_unfolded(key, arrays): _unfolded(part, arrays) for key, part in tree["$pairs"]}
    return {key: _unfolded(part, arrays) for key, part in tree.items()}


def _in_rows(numbers: list[int]) -> str:
    """Return numbers as people write them, those that follow each other as one row.

    >>> _in_rows([0, 1, 2, 3, 7, 9, 10])
    '0 to 3, 7, 9, 10'
    """
    rows: list[list[int]] = []
    for number in numbers:
        if rows and number == rows[-1][-1] + 1:
            rows[-1].append(number)
        else:
            rows.append([number])
    ranges = [f"{row[0]} to {row[-1]}" if len(row) > 2 else ", ".join(map(str, row)) for row in rows]
    return ", ".join(ranges)
