"""`racecraft notebooks DIR`: the notebooks of log analysis, over local logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def notebooks(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where they shall lie.")],
    logs: Annotated[
        Path | None, typer.Option(help="The log they begin with: whatever `racecraft logs` reads; by default the run.")
    ] = None,
    run: Annotated[Path | None, typer.Option(help="The run they begin with; by default the newest in runs.")] = None,
    replace: Annotated[bool, typer.Option("--replace", help="Write over notebooks that are there already.")] = False,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Write notebooks: training, evaluation, metrics, action space, what it looks at, the workshops' log analysis.

    They need Jupyter to be opened, and nothing but racecraft to run; change them as you like.

    Examples:

        racecraft notebooks notebooks

        racecraft notebooks mine --logs downloads/model.tar.gz
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.notebooks.write import write_notebooks

    written = write_notebooks(folder, str(logs or ""), str(run or ""), replace=replace)
    if json:
        print_json({"written": [str(path) for path in written]})
        return
    for path in written:
        print(path)
    print(f'Open them: pip install jupyterlab, then jupyter lab "{folder}"')
