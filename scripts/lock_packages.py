"""Pin every package that builders install, with the sums of its files: `python scripts/lock_packages.py [--check]`.

uv resolves pyproject.toml's `dev` extra under constraints.txt for all promised systems and Pythons and writes
`builders.lock`, which `scripts/make_env.py` installs with `--require-hashes`. PyTorch and the CUDA packages that it
brings are left out: the CPU build comes from an index of PyTorch's own. Only a maintainer who changes a dependency
runs this, in an environment of `make env`.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "builders.lock"
LEFT_OUT = re.compile(r"(torch|triton|nvidia-.*|cuda-.*)==")
HEAD = """\
# Made by scripts/lock_packages.py from pyproject.toml and constraints.txt. PyTorch and its CUDA packages are not in it:
# scripts/make_env.py installs them by version alone.
"""


def main() -> int:
    """Write the lock, or tell whether it fits."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 where the lock is another")
    asked = parser.parse_args()
    text = HEAD + "".join(block for block in resolved() if not LEFT_OUT.match(block))
    if asked.check:
        return int(not LOCK.is_file() or LOCK.read_text(encoding="utf-8") != text)
    LOCK.write_text(text, encoding="utf-8")
    print(f"{LOCK.name}: {text.count('==')} packages")
    return 0


def resolved() -> list[str]:
    """Return what uv resolves, a block of lines for each package."""
    uv = shutil.which("uv", path=str(Path(sys.executable).parent))
    if uv is None:
        sys.exit(
            "No uv stands beside this Python; expected one, since it resolves for all systems at once. "
            "Run this with .venv/bin/python after `make env`."
        )
    command = [uv, "pip", "compile", "pyproject.toml", "--extra", "dev", "--constraint", "constraints.txt"]
    how = ["--universal", "--python-version", "3.11", "--generate-hashes", "--no-header", "--no-annotate", "--quiet"]
    done = subprocess.run([*command, *how], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    return re.split(r"^(?=[a-z0-9])", done.stdout, flags=re.MULTILINE)[1:]


if __name__ == "__main__":
    raise SystemExit(main())
