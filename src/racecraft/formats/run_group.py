"""A folder with the runs of several seeds of one training: `group.json` names them. Begin with `RunGroup`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.errors import RunFolderError
from racecraft.formats.atomic import make_folder, write_atomic

GROUP = "group.json"
FORMAT, VERSION = "racecraft group", 1


@dataclass(frozen=True)
class RunGroup:
    """Runs that differ in their seed alone."""

    path: Path
    command: tuple[str, ...]
    """The words behind `racecraft` that every run was trained by, without seed and folder."""
    seeds: tuple[int, ...]

    @property
    def runs(self) -> tuple[Path, ...]:
        """The run folders, in the order of the seeds; one whose training has not begun is not there yet."""
        return tuple(self.run_of(seed) for seed in self.seeds)

    def run_of(self, seed: int) -> Path:
        """Return the run folder of a seed."""
        return self.path / f"seed-{seed}"

    def write(self) -> None:
        """Make the folder and write which runs it holds.

        Raises:
            OutputFileError: The place cannot be written.
        """
        make_folder(self.path)
        document = {"format": FORMAT, "version": VERSION, "command": list(self.command), "seeds": list(self.seeds)}
        write_atomic(self.path / GROUP, json.dumps(document, indent=2) + "\n")

    @classmethod
    def open(cls, path: str | Path) -> RunGroup:
        """Open a group.

        Raises:
            RunFolderError: There is none, it is damaged, or a newer racecraft wrote it.
        """
        path = Path(path)
        try:
            document = json.loads((path / GROUP).read_text(encoding="utf-8"))
            is_ours = document["format"] == FORMAT and 1 <= document["version"] <= VERSION
            group = cls(path, tuple(map(str, document["command"])), tuple(map(int, document["seeds"])))
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise RunFolderError(
                "{path}: cannot be read ({error}); expected a group of runs.", path=path / GROUP, error=error
            ) from error
        if not is_ours:
            raise RunFolderError(
                "{path}: found another format or a newer version; expected version {version}.",
                path=path / GROUP,
                version=VERSION,
            )
        return group


def is_group(path: str | Path) -> bool:
    """Tell whether a folder is a group of runs."""
    return (Path(path) / GROUP).is_file()
