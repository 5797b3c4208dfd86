"""Write the notebooks of log analysis, over local logs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option


@dataclass(frozen=True, kw_only=True)
class NotebooksRequest(Request):
    """Where they are written, and what they begin with."""

    folder: Path = argument("Where they shall lie.", metavar="DIR")
    logs: Path | None = option(None, "The log they begin with: whatever `racecraft logs` reads; by default the run.")
    run: Path | None = option(None, "The run they begin with; by default the newest in runs.")
    replace: bool = option(False, "Write over notebooks that are there already.")


@dataclass(frozen=True)
class Notebooks:
    """The notebooks that were written."""

    folder: Path
    written: list[Path]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the notebooks."""
        return {"written": self.written}


@action
def notebooks(request: NotebooksRequest, progress: Progress = quiet) -> Notebooks:
    """Write notebooks: training, evaluation, metrics, action space, what it looks at, the workshops' log analysis.

    They need Jupyter to be opened, and nothing but racecraft to run; change them as you like.

    Examples:

        racecraft notebooks notebooks

        racecraft notebooks mine --logs downloads/model.tar.gz
    """
    from racecraft.worlds.deepracer.notebooks.write import write_notebooks

    written = write_notebooks(request.folder, str(request.logs or ""), str(request.run or ""), replace=request.replace)
    return Notebooks(request.folder, list(written))
