"""Files that settings name travel with the run: what is learned from is found again wherever one stands.

A group that learns from recorded episodes calls its file `demonstrations` (`bc.demonstrations`); ML-Agents' may be a
folder of them. A new run takes a copy along and names the copy; whoever goes on with the run, in another folder or on
another machine, reads that one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from racecraft.contract.kinds import kinds
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.composition import Settings

SETTING = "demonstrations"
"""The setting that names a file, in whatever group."""


def named_files(settings: Settings, of: str = "") -> dict[str, Path]:
    """Return what settings name, each under the name of its copy: "bc-demonstrations.safetensors", or a folder's.

    `of` tells several learners of one run apart: "Goalie" makes "Goalie-bc-demonstrations.safetensors".
    """
    paths = {group: path for group in settings if (path := _path_in(settings, group)) is not None}
    return {_copy_of(group, path, of): path for group, path in paths.items() if _files_of(path)}


def lay_named_files(files: Mapping[str, Path], run: RunFolder) -> None:
    """Copy them into a new run folder.

    Raises:
        OutputFileError: There is no room for them.
    """
    for name, path in files.items():
        if path.is_dir():
            make_folder(run.path / name)
        for file in _files_of(path):
            write_atomic(run.path / name / file.relative_to(path), file.read_bytes())


def as_in_run(settings: Settings, of: str = "") -> Settings:
    """Return the settings with the copies' names in the place of the files': what a run says of itself."""
    for group in settings:
        path = _path_in(settings, group)
        if path is not None and _files_of(path):
            settings = _with_path(settings, group, _copy_of(group, path, of))
    return settings


def overrides_in_run(names: Iterable[str], settings: Settings) -> list[str]:
    """Return `group.name=value` as given, with the copies' names in the place of the files'."""
    copies = {f"{_group(name)}.{SETTING}={path}": name for name, path in named_files(settings).items()}
    return [f"{_group(copies[one])}.{SETTING}={copies[one]}" if one in copies else one for one in names]


def found_in_run(settings: Settings, run: RunFolder, of: str = "") -> Settings:
    """Return the settings with the paths of the copies that a run has; a file that it has no copy of stays named."""
    for group in settings:
        path = _path_in(settings, group)
        copy = run.path / _copy_of(group, path, of) if path is not None else None
        if copy is not None and copy.exists():
            settings = _with_path(settings, group, str(copy))
    return settings


def _files_of(path: Path) -> list[Path]:
    """Return the file itself, or the demonstrations in a folder; nothing where neither is there."""
    if path.is_dir():
        suffixes = {kind.demonstration_suffix for kind in kinds()} - {""}
        return sorted(file for suffix in suffixes for file in path.glob(f"*{suffix}"))
    return [path] if path.is_file() else []


def _path_in(settings: Settings, group: str) -> Path | None:
    path = getattr(getattr(settings, group), SETTING, None)
    return None if path is None else Path(path)


def _copy_of(group: str, path: Path, of: str) -> str:
    return f"{of}-{group}-{SETTING}{path.suffix}" if of else f"{group}-{SETTING}{path.suffix}"


def _with_path(settings: Settings, group: str, path: str) -> Settings:
    return settings.with_group(group, replace(getattr(settings, group), **{SETTING: path}))


def _group(name: str) -> str:
    return name.partition(f"-{SETTING}")[0]
