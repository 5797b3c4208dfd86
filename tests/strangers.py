"""Packages that are not ours, as pip would install them: for tests of racecraft's entry points."""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path


def install(package: Path, site: Path) -> None:
    """Lay down what `pip install` would lay down of the metadata of a package, by its pyproject.toml."""
    project = tomllib.loads((package / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    info = site / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    groups = project["entry-points"]
    text = "\n".join(f"[{group}]\n" + "\n".join(f"{k} = {v}" for k, v in groups[group].items()) for group in groups)
    (info / "entry_points.txt").write_text(text + "\n", encoding="utf-8")


def surroundings(path: list) -> dict[str, str]:
    """Return the variables of a process that has folders first on its path."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, [*path, *sys.path])), "COLUMNS": "120"}


def run_python(code: str, *words: str, path: list, folder: Path, expected: int = 0) -> str:
    """Run Python with folders first on its path, in a folder; return what it prints, errors behind."""
    done = subprocess.run(
        [sys.executable, "-c", code, *words], cwd=folder, env=surroundings(path), capture_output=True, text=True
    )
    assert done.returncode == expected, done.stderr
    return done.stdout + done.stderr


ONE_AFTER_THE_OTHER = """
import contextlib, io, json, sys, traceback
answers = sys.stdout
for line in sys.stdin:
    code, words = json.loads(line)
    sys.argv, ended, out, err = ["racecraft", *words], 0, io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            exec(code, {"__name__": "__main__"})
        except SystemExit as left:
            ended = left.code or 0
        except BaseException:
            traceback.print_exc()
            ended = 1
    print(json.dumps([ended, out.getvalue() + err.getvalue()]), file=answers, flush=True)
"""


class Stranger:
    """Whoever has installed a package: runs commands and code in a folder of their own, all in one process.

    Args:
        path: Folders that come first on its path.
        folder: Where it is.
    """

    def __init__(self, path: list, folder: Path) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", ONE_AFTER_THE_OTHER], cwd=folder, env=surroundings(path), text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip

    def __call__(
        self, *words: str, code: str = "from racecraft.cli.entry import main; main()", expected: int = 0
    ) -> str:
        """Run a command, or code; return what it prints, errors behind."""
        self._process.stdin.write(json.dumps([code, words]) + "\n")
        self._process.stdin.flush()
        ended, said = json.loads(self._process.stdout.readline())
        assert ended == expected, said
        return said

    def close(self) -> None:
        """Let it go."""
        self._process.communicate()
