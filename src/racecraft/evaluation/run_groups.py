"""Runs as groups of seeds, and what differs between two groups. Begin with `group_runs`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import RunFolder, last_stops
from racecraft.formats.run_group import RunGroup, is_group
from racecraft.players.open_run import open_run

NO_SETTINGS = ("runtime",)
"""Groups of settings that decide how a training runs, not what it learns."""
MAX_NAMES = 3


@dataclass(frozen=True)
class NamedRun:
    """A run, and which of its checkpoints is meant."""

    run: RunFolder
    which: str

    @property
    def name(self) -> str:
        """The folder's name; of a numbered run of a model, as models/fast-car/runs/2, the model's too: "fast-car/2"."""
        path = self.run.path.resolve()
        is_of_model = path.name.isdigit() and path.parent.name == "runs"
        return f"{path.parents[1].name}/{path.name}" if is_of_model else path.name


@dataclass(frozen=True)
class SeedGroup:
    """Runs with the same settings."""

    name: str
    runs: tuple[NamedRun, ...]
    settings: Mapping[str, Any]
    """By name, of the first run."""


@dataclass(frozen=True)
class Difference:
    """A setting in which two groups differ."""

    name: str
    values: tuple[Any, ...]
    """In the order of the groups; None where a group has no such setting."""


def group_runs(sources: Iterable[str]) -> list[SeedGroup]:
    """Return groups of seeds: a group's folder is one, and so are runs with the same settings.

    Args:
        sources: Folders of runs, RUN:last and the like among them, or of groups.

    Raises:
        RunFolderError: There is no run or group at a place, or a run is damaged.
        SettingError: A run is named twice, or the runs are of several kinds of world or on several tracks.
    """
    groups: list[SeedGroup] = []
    loose: dict[str, list[tuple[NamedRun, dict[str, Any]]]] = {}
    for source in sources:
        path, which = split_source(source)
        if is_group(path):
            group = RunGroup.open(path)
            named = [NamedRun(RunFolder.open(run), which) for run in group.runs if run.is_dir()]
            if not named:
                raise SettingError("{path}: none of its seeds has begun; expected one run at least.", path=path)
            groups.append(SeedGroup(group.path.resolve().name, tuple(named), settings_of(named[0].run, which)))
            continue
        one = NamedRun(open_run(path), which)
        settings = settings_of(one.run, which)
        key = json.dumps(settings, sort_keys=True, default=str)
        loose.setdefault(key, []).append((one, settings))
    for alike in loose.values():
        runs = tuple(one for one, _ in alike)
        groups.append(SeedGroup(_name_of(runs), runs, alike[0][1]))
    _require_comparable(groups)
    return groups


def settings_of(run: RunFolder, which: str) -> dict[str, Any]:
    """Return everything that decides how good a checkpoint of a run is, by name, but its seed, name and place."""
    job = run.read_job()
    request = job.get("asked") or {}
    result: dict[str, Any] = {"kind": job.get("kind"), "algorithm": job.get("algorithm"), "checkpoint": which}
    result |= {"track": (job.get("track") or {}).get("name"), "stops": list(last_stops(job))}
    result |= {"begun from": request.get("from"), "against": request.get("against")}
    metadata = job.get("model_metadata") or {}
    result |= {name.replace("_", " "): metadata[name] for name in ("action_space", "sensor") if name in metadata}
    if run.reward_function.is_file():
        text = run.reward_function.read_bytes().replace(b"\r\n", b"\n")
        result["reward function"] = hashlib.sha256(text).hexdigest()[:8]
    result["racecraft"] = (job.get("versions") or {}).get("racecraft")
    for group, settings in (job.get("settings") or {}).items():
        if group not in NO_SETTINGS:
            result |= _flat(group, settings)
    return {name: value for name, value in result.items() if value not in (None, [], {})}


def differences(groups: Iterable[SeedGroup]) -> list[Difference]:
    """Return the settings in which groups differ, by name."""
    each = [group.settings for group in groups]
    names = sorted({name for settings in each for name in settings})
    rows = [Difference(name, tuple(settings.get(name) for settings in each)) for name in names]
    return [row for row in rows if any(value != row.values[0] for value in row.values)]


def _flat(name: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        return {name: value}
    return {key: part for below, inner in value.items() for key, part in _flat(f"{name}.{below}", inner).items()}


def _name_of(runs: tuple[NamedRun, ...]) -> str:
    names = [one.name if one.which == "best" else f"{one.name}:{one.which}" for one in runs]
    return ", ".join(names) if len(names) <= MAX_NAMES else f"{names[0]} … {names[-1]}"


def _require_comparable(groups: list[SeedGroup]) -> None:
    """Refuse what no comparison can be made of."""
    places = [(one.run.path.resolve(), one.which) for group in groups for one in group.runs]
    if twice := {str(place) for place, which in places if places.count((place, which)) > 1}:
        raise SettingError("{twice} is named twice; expected every run once.", twice=sorted(twice)[0])
    for name in ("kind", "track"):
        found = sorted({str(group.settings.get(name)) for group in groups})
        if len(found) > 1:
            raise SettingError(
                "the runs differ in their {name} ({found}); expected one {name}.", name=name, found=", ".join(found)
            )
