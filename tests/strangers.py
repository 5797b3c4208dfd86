"""Packages that are not ours, as pip would install them: for tests of racecraft's entry points."""

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


def run_python(code: str, *words: str, path: list, folder: Path, expected: int = 0) -> str:
    """Run Python with folders first on its path, in a folder; return what it prints, errors behind."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, [*path, *sys.path])), "OMP_NUM_THREADS": "1"}
    environment["COLUMNS"] = "120"
    done = subprocess.run(
        [sys.executable, "-c", code, *words], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == expected, done.stderr
    return done.stdout + done.stderr
