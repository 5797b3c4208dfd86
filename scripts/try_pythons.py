"""Run the tests on every Python that racecraft promises and that is installed here, each in an environment of its own.

    python scripts/try_pythons.py                     every one that is found
    python scripts/try_pythons.py 3.13 -- tests/formats -x     one of them; what follows -- goes to pytest
    python scripts/try_pythons.py --newest            this Python, every dependency but PyTorch in its newest version

Pythons are looked for on the PATH (python3.12) and among pyenv's. Environments stand in .venvs/<version> and are made
once; where PyTorch cannot be installed on one, that is said, and the Python counts as not tried.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

import make_env

ROOT = Path(__file__).resolve().parents[1]
PLACE = ROOT / ".venvs"
PROMISED = ("3.11", "3.12", "3.13", "3.14")
CONSTRAINTS = ROOT / "constraints.txt"


def main(words: list[str]) -> int:
    """Try each Python; 0 where all that are here pass and one was tried, 1 where one failed, 2 where none is here."""
    cut = words.index("--") if "--" in words else len(words)
    own, for_pytest = words[:cut], words[cut + 1 :] or ["-q"]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("versions", nargs="*", default=[], help=f"by default {', '.join(PROMISED)}")
    parser.add_argument("--newest", action="store_true", help="this Python with every dependency's newest version")
    options = parser.parse_args(own)
    if options.newest:
        outcome = run_tests("newest", Path(sys.executable), _only_torch(), for_pytest)
        print(f"Newest versions: {outcome}")
        return {"passed": 0, "failed": 1}.get(outcome, 2)
    asked = options.versions or list(PROMISED)
    if unknown := [version for version in asked if version not in PROMISED]:
        parser.error(f"racecraft promises nothing on {', '.join(unknown)}; expected {', '.join(PROMISED)}")
    told = {version: tried(version, for_pytest) for version in asked}
    print("\n".join(f"Python {version}: {what}" for version, what in told.items()))
    outcomes = set(told.values())
    return 1 if "failed" in outcomes else 0 if "passed" in outcomes else 2


def tried(version: str, for_pytest: list[str]) -> str:
    """Return what came of a Python: "passed", "failed", or why it was not tried."""
    python = find_python(version)
    if python is None:
        return "not installed here"
    return run_tests(version, python, CONSTRAINTS, for_pytest)


def run_tests(name: str, python: Path, constraints: Path, for_pytest: list[str]) -> str:
    """Make an environment where there is none yet, run the tests in it, and return what came of them."""
    inside = environment(name, python, constraints)
    if inside is None:
        return "not tried: its packages could not be installed"
    print(f"\nTests in .venvs/{name} …", flush=True)
    return "passed" if subprocess.run([inside, "-m", "pytest", *for_pytest], cwd=ROOT).returncode == 0 else "failed"


def _only_torch() -> Path:
    """Write the constraints of `--newest`: PyTorch as pinned, since a newer one may be a CUDA build of gigabytes."""
    PLACE.mkdir(exist_ok=True)
    pins = [line for line in CONSTRAINTS.read_text().splitlines() if line.startswith("torch==")]
    path = PLACE / "only-torch.txt"
    path.write_text("\n".join(pins) + "\n")
    return path


def find_python(version: str) -> Path | None:
    """Return the interpreter of a version: this one, one on the PATH that really starts, or pyenv's newest."""
    if ".".join(map(str, sys.version_info[:2])) == version:
        return Path(sys.executable)
    versions = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    of_pyenv = sorted(versions.glob(f"{version}.*/bin/python"), key=_number, reverse=True)
    on_path = shutil.which(f"python{version}")
    for python in [*of_pyenv, *([Path(on_path)] if on_path else [])]:
        if _answers(python, version):
            return python
    return None


def environment(name: str, python: Path, constraints: Path) -> Path | None:
    """Return the interpreter of an environment with all that the tests need; None where it cannot be made."""
    place = PLACE / name
    inside = place / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    stamp = place / "made"
    if stamp.exists():
        return inside
    print(f"\nMaking .venvs/{name} …", flush=True)
    pip = [inside, "-m", "pip", "--disable-pip-version-check", "install", "-qq", "-c", constraints]
    made = subprocess.run([python, "-m", "venv", place]).returncode == 0
    if made and sys.platform == "linux" and shutil.which("nvidia-smi") is None:
        small = ("--index-url", make_env.CPU_INDEX, "--timeout", "10", "--retries", "0", "torch")
        subprocess.run([*pip, *small], stderr=subprocess.DEVNULL)  # where it does not answer, the index below has one
    if not made or subprocess.run([*pip, "-e", f"{ROOT}[dev]"]).returncode:
        return None
    stamp.touch()
    return inside


def _number(path: Path) -> tuple[int, ...]:
    return tuple(int(part) if part.isdigit() else -1 for part in path.parents[1].name.split("."))


def _answers(python: Path, version: str) -> bool:
    """Tell whether an interpreter starts and is of that version: pyenv's stand-ins may only say what is not set up."""
    code = "import sys; print('.'.join(map(str, sys.version_info[:2])))"
    try:
        done = subprocess.run([python, "-c", code], capture_output=True, text=True, timeout=30)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0 and done.stdout.strip() == version


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
