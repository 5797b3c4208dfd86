"""Make .venv with everything a builder needs. Running it again costs nothing when nothing changed.

PyTorch is the one big guest. A torch that is there and new enough stays. On a Linux machine without an NVIDIA GPU the
CPU build is asked for first, from PyTorch's own index; where that index cannot be reached, the version pinned in
constraints.txt is taken from the configured package index, and the size is said before the download. Everything else is
installed from builders.lock: what is not the file that was pinned, by its sum, is refused. Bytecode is left to the
first import, since half of what is installed is never imported.
"""

from __future__ import annotations

import hashlib
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv"
PYTHON = VENV / ("Scripts/python.exe" if platform.system() == "Windows" else "bin/python")
STAMP = VENV / "made-from"
CONSTRAINTS = ROOT / "constraints.txt"
LOCK = ROOT / "builders.lock"
CPU_INDEX = "https://download.pytorch.org/whl/cpu"
OLDEST_PYTHON = (3, 11)


def main() -> int:
    """Make or complete the environment."""
    if sys.version_info[:2] < OLDEST_PYTHON:
        print(f"Python {platform.python_version()} is too old; racecraft needs 3.11 to 3.14.")
        print("Install one and say `make env PYTHON=python3.12`.")
        return 2
    if is_current():
        return 0
    if not PYTHON.exists():
        print("Making .venv: 2.8 GB on disk, about a minute with a fast connection.", flush=True)
        venv.create(VENV, with_pip=True)
    if not has_torch():
        install_torch()
    with step(f"Installing the {LOCK.read_text().count('==')} packages of builders.lock"):
        install_lock()
    with step("Installing racecraft itself, as it stands in this folder"):
        pip("install", "--no-deps", "--no-build-isolation", "-e", str(ROOT))
    STAMP.write_text(wanted())
    print("The environment is ready: .venv")
    return 0


def is_current() -> bool:
    """Tell whether .venv was made from today's pyproject.toml, constraints and lock."""
    return PYTHON.exists() and STAMP.exists() and STAMP.read_text() == wanted()


def wanted() -> str:
    """Return a fingerprint of what the environment is made from."""
    parts = [(ROOT / name).read_bytes() for name in ("pyproject.toml", "constraints.txt", "builders.lock")]
    return hashlib.sha256(b"\0".join([*parts, str(ROOT).encode()])).hexdigest()


def has_torch() -> bool:
    """Tell whether a torch that is new enough is installed."""
    code = "import sys, importlib.metadata as m; sys.exit(tuple(map(int, m.version('torch').split('.')[:2])) < (2, 8))"
    return subprocess.run([PYTHON, "-c", code], stderr=subprocess.DEVNULL).returncode == 0


def install_torch() -> None:
    """Install the pinned torch; the CPU build where no NVIDIA GPU is seen."""
    wants_cpu = platform.system() == "Linux" and shutil.which("nvidia-smi") is None
    if wants_cpu:
        tries = ("--index-url", CPU_INDEX, "--timeout", "10", "--retries", "0")
        with step("Installing PyTorch, CPU build (about 200 MB)"):
            if pip("install", "--no-compile", *tries, "-c", str(CONSTRAINTS), "torch", must=False):
                return
        print("PyTorch's CPU index did not answer; taking torch from the configured index.")
        print("If that is the CUDA build it is about 3 GB; Ctrl-C stops it.", flush=True)
    with step("Installing PyTorch" if wants_cpu else "Installing PyTorch (with CUDA about 3 GB on Linux)"):
        pip("install", "--no-compile", "-c", str(CONSTRAINTS), "torch")


def install_lock() -> None:
    """Install what builders.lock pins: with uv, which takes a tenth of the time, and with pip where uv fails.

    uv reads no settings of pip's, so that it does not find an index that only these name.
    """
    pinned = ("--no-deps", "--require-hashes", "-r")
    (of_uv,) = re.findall(r"^uv==.*(?:\n    .*)*", LOCK.read_text(encoding="utf-8"), flags=re.MULTILINE)
    with tempfile.TemporaryDirectory() as folder:
        only_uv = Path(folder) / "uv.txt"
        only_uv.write_text(of_uv, encoding="utf-8")
        has_uv = pip("install", *pinned, str(only_uv), must=False)
    uv = [str(PYTHON.with_name("uv")), "pip", "install", "--quiet", "--python", str(PYTHON), *pinned, str(LOCK)]
    if not has_uv or subprocess.run(uv, stderr=subprocess.DEVNULL).returncode != 0:
        pip("install", "--no-compile", *pinned, str(LOCK))


@contextmanager
def step(what: str) -> Iterator[None]:
    """Say what is being done, and how long it took."""
    print(f"{what} …", end=" ", flush=True)
    began = time.monotonic()
    yield
    print(f"{time.monotonic() - began:.0f} s", flush=True)


def pip(*arguments: str, must: bool = True) -> bool:
    """Run pip inside .venv, which prints errors only; tell whether it succeeded."""
    command = [str(PYTHON), "-m", "pip", "-qq", "--disable-pip-version-check", *arguments]
    done = subprocess.run(command, stderr=None if must else subprocess.DEVNULL)
    if must and done.returncode != 0:
        raise SystemExit(f"pip failed; the command was: {' '.join(command)}")
    return done.returncode == 0


if __name__ == "__main__":
    raise SystemExit(main())
