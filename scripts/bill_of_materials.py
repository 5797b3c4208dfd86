"""Write what an installation consists of as CycloneDX 1.6: `python scripts/bill_of_materials.py [FILE] [--extra dev]`.

Python packages are those that racecraft needs in the environment that runs this, the extras named included, each with
the version and the licence that it states; JavaScript and fonts are the files under `vendor/`, each with its SHA-256.
The same environment gives the same file: there is no time and no random number in it.
"""

from __future__ import annotations

import argparse
import json
import re
import tomllib
from collections.abc import Iterable, Iterator
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "scripts" / "javascript" / "package-lock.json"
NPM_NAMES = {
    "uplot": ("uplot",),
    "inter": ("@fontsource-variable/inter",),
    "codemirror": (
        "@codemirror/autocomplete", "@codemirror/commands", "@codemirror/lang-python", "@codemirror/language",
        "@codemirror/lint", "@codemirror/search", "@codemirror/state", "@codemirror/streamparser", "@codemirror/view",
        "@lezer/common", "@lezer/highlight", "@lezer/lr", "@lezer/python", "@marijn/find-cluster-break", "crelt",
        "style-mod", "w3c-keyname",
    ),
}  # fmt: skip
"""Packages by what their vendored files begin with; a bundle holds several."""


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, nargs="?", default=ROOT / "dist" / "racecraft.cdx.json")
    parser.add_argument("--extra", action="append", default=[], help="an extra of racecraft's; may be repeated")
    asked = parser.parse_args()
    asked.file.parent.mkdir(parents=True, exist_ok=True)
    made = bill(asked.extra)
    asked.file.write_text(json.dumps(made, indent=2) + "\n", encoding="utf-8")
    print(f"{asked.file}: {len(made['components'])} components")


def bill(extras: Iterable[str] = ()) -> dict[str, Any]:
    """Return the bill of materials as CycloneDX's JSON."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [*project["dependencies"], *(text for one in extras for text in project["optional-dependencies"][one])]
    found = installed(wanted)
    ours = f"pkg:pypi/racecraft@{project['version']}"
    needs = {ours: names(wanted)} | {purl(package): names(package.requires or ()) for package in found.values()}
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {
            "component": {
                "type": "application", "bom-ref": ours, "name": "racecraft", "version": project["version"], "purl": ours
            }
        },
        "components": [*(component(found[name]) for name in sorted(found)), *vendored_components()],
        "dependencies": [
            {"ref": ref, "dependsOn": sorted({purl(found[name]) for name in needed if name in found})}
            for ref, needed in sorted(needs.items())
        ],
    }  # fmt: skip


def installed(wanted: Iterable[str]) -> dict[str, Distribution]:
    """Return the packages that requirements need here, and what those need, by name."""
    found: dict[str, Distribution] = {}
    waiting, seen = list(needed_here(wanted)), set()
    while waiting:
        one = waiting.pop()
        if one in seen:
            continue
        seen.add(one)
        name, extras = one
        try:
            found[name] = distribution(name)
        except PackageNotFoundError:
            raise SystemExit(f"{name} is not installed here; expected it, since racecraft needs it.") from None
        waiting.extend(needed_here(found[name].requires or (), extras))
    return found


def needed_here(texts: Iterable[str], extras: Iterable[str] = ()) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the name and the extras of each requirement that holds on this system."""
    for text in texts:
        needed = Requirement(text)
        if needed.marker is None or any(needed.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
            yield normal(needed.name), tuple(sorted(needed.extras))


def names(texts: Iterable[str]) -> set[str]:
    """Return the names of the requirements that hold on this system."""
    return {name for name, _ in needed_here(texts)}


def component(package: Distribution) -> dict[str, Any]:
    """Return a Python package as CycloneDX has it."""
    made = {
        "type": "library",
        "bom-ref": purl(package),
        "name": normal(package.name),
        "version": package.version,
        "purl": purl(package),
    }
    expression = package.metadata.get("License-Expression")
    licence = expression or (package.metadata.get("License") or "").split("\n")[0][:80]
    if licence:
        kind = "expression" if expression else "license"
        made["licenses"] = [{kind: licence if kind == "expression" else {"name": licence}}]
    return made


def vendored_components() -> Iterator[dict[str, Any]]:
    """Yield the files of other makers that lie in the package."""
    pinned = json.loads(LOCK.read_text(encoding="utf-8"))["packages"]
    for sums in sorted((ROOT / "src" / "racecraft").rglob("vendor/sums.json")):
        for file, digest in sorted(json.loads(sums.read_text(encoding="utf-8")).items()):
            begin = file.partition(".")[0]
            if begin not in NPM_NAMES:
                raise SystemExit(f"{sums}: {file} is of no known package; expected it in NPM_NAMES.")
            for name in NPM_NAMES[begin]:
                package = pinned[f"node_modules/{name}"]
                yield {
                    "type": "file",
                    "name": sums.with_name(file).relative_to(ROOT).as_posix(),
                    "version": package["version"],
                    "purl": f"pkg:npm/{name.replace('@', '%40')}@{package['version']}",
                    "hashes": [{"alg": "SHA-256", "content": digest}],
                    "licenses": [{"license": {"id": package["license"]}}],
                }


def purl(package: Distribution) -> str:
    """Return the address of a package; a local build keeps its name (torch 2.13.0+cpu)."""
    return f"pkg:pypi/{normal(package.name)}@{package.version.replace('+', '%2B')}"


def normal(name: str) -> str:
    """Return a package's name as the index spells it.

    >>> normal("Flask_Cors")
    'flask-cors'
    """
    return re.sub(r"[-_.]+", "-", name).lower()


if __name__ == "__main__":
    main()
