"""Check the types of our JavaScript with TypeScript's compiler: `make javascript`. Only builders need Node and npm.

    python scripts/check_javascript.py

npm fetches what `scripts/javascript/package-lock.json` pins; `scripts/javascript/tsconfig.json` says what is checked,
`scripts/javascript/types/page.d.ts` what is not: elements found by a selector and other makers' modules.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PINNED = Path(__file__).parent / "javascript"


def main() -> int:
    """Return tsc's exit code: 0 where nothing is wrong; 2 without npm."""
    if shutil.which("npm") is None:
        print("npm is not installed here; install Node.js, which brings it.", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as work:
        for name in ("package.json", "package-lock.json"):
            shutil.copy(PINNED / name, work)
        subprocess.run(["npm", "ci", "--no-audit", "--no-fund", "--silent"], cwd=work, check=True)
        return subprocess.run([f"{work}/node_modules/.bin/tsc", "-p", str(PINNED)]).returncode


if __name__ == "__main__":
    raise SystemExit(main())
