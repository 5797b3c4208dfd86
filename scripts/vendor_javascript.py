"""Puts other makers' files beside our pages: uPlot, CodeMirror and Inter, for tests axe.

Only a maintainer who updates one runs it.

    python scripts/vendor_javascript.py

npm fetches what `scripts/javascript/package-lock.json` pins, with its sums; esbuild makes one ES module each of
uPlot and of what `scripts/javascript/codemirror.js` names; `sums.json` records what came out. Users and builds need
neither Node nor npm: the results are committed.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
PINNED = ROOT / "scripts" / "javascript"
VENDOR = ROOT / "src" / "racecraft" / "pages" / "vendor"
TESTS = ROOT / "tests" / "vendor"

COPIED = {
    VENDOR / "uplot.css": "uplot/dist/uPlot.min.css",
    VENDOR / "uplot.LICENSE": "uplot/LICENSE",
    VENDOR / "codemirror.LICENSE": "@codemirror/view/LICENSE",
    VENDOR / "inter.woff2": "@fontsource-variable/inter/files/inter-latin-wght-normal.woff2",
    VENDOR / "inter.LICENSE": "@fontsource-variable/inter/LICENSE",
    TESTS / "axe.min.js": "axe-core/axe.min.js",
    TESTS / "axe.LICENSE": "axe-core/LICENSE",
}
BUILT = {
    VENDOR / "uplot.js": "node_modules/uplot/dist/uPlot.esm.js",
    VENDOR / "codemirror.js": "codemirror.js",
}


def main() -> None:
    """Fetch, build and write everything anew."""
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for name in ("package.json", "package-lock.json", "codemirror.js"):
            if (PINNED / name).is_file():
                shutil.copy(PINNED / name, work)
        fetch = "ci" if (work / "package-lock.json").is_file() else "install"
        subprocess.run(["npm", fetch, "--no-audit", "--no-fund"], cwd=work, check=True)
        shutil.copy(work / "package-lock.json", PINNED)
        for target, source in COPIED.items():
            target.parent.mkdir(exist_ok=True)
            shutil.copy(work / "node_modules" / source, target)
        for target, source in BUILT.items():
            build = ["node_modules/.bin/esbuild", source, "--bundle", "--minify", "--format=esm", "--charset=utf8"]
            subprocess.run([*build, f"--outfile={target}"], cwd=work, check=True)
    for place in (VENDOR, TESTS):
        files = sorted(path for path in place.iterdir() if path.name not in ("sums.json", "README.md"))
        sums = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
        (place / "sums.json").write_text(json.dumps(sums, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
