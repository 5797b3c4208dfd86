"""What builders install is pinned by sum, and what an installation consists of can be told."""

import hashlib
import json
import re
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "scripts"))
import bill_of_materials  # noqa: E402

BY_VERSION_ALONE = {"torch"}


def pins(name):
    """Return {package: version} of a file of pins."""
    found = re.findall(
        r"^([a-z0-9][a-z0-9._-]*)==([^ ;\\\n]+)", (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE
    )
    return dict(found)


def test_every_package_of_builders_is_pinned_with_sums_and_as_constrained():
    lock, constraints = pins("builders.lock"), pins("constraints.txt")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for text in (*project["dependencies"], *project["optional-dependencies"]["dev"]):
        needed = Requirement(text)
        if needed.name not in BY_VERSION_ALONE:
            assert lock[needed.name] in needed.specifier, f"{text}: run scripts/lock_packages.py"
    differing = {name for name in lock.keys() & constraints.keys() if lock[name] != constraints[name]}
    assert not differing, "run scripts/lock_packages.py"
    assert not lock.keys() & BY_VERSION_ALONE
    blocks = re.split(r"^(?=[a-z0-9])", (ROOT / "builders.lock").read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    assert len(blocks) >= len(lock)
    assert all(re.search(r"--hash=sha256:[0-9a-f]{64}", block) for block in blocks)


def test_the_bill_of_materials_names_every_package_and_vendored_file_with_its_sum():
    bill = bill_of_materials.bill()
    parts = {one["name"]: one for one in bill["components"]}
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    assert parts["starlette"]["purl"] == f"pkg:pypi/starlette@{version('starlette')}"
    assert "anyio" in parts, "what starlette needs is in it, too"
    assert "pytest" not in parts
    for sums in (ROOT / "src").rglob("vendor/sums.json"):
        for file in json.loads(sums.read_text(encoding="utf-8")):
            path = sums.with_name(file)
            stated = parts[path.relative_to(ROOT).as_posix()]["hashes"][0]["content"]
            assert stated == hashlib.sha256(path.read_bytes()).hexdigest()
    refs = {
        bill["metadata"]["component"]["bom-ref"],
        *(one["bom-ref"] for one in bill["components"] if "bom-ref" in one),
    }
    assert {ref for one in bill["dependencies"] for ref in (one["ref"], *one["dependsOn"])} <= refs
    assert len(refs) == sum("bom-ref" in one for one in bill["components"]) + 1, "no reference stands for two"
    assert bill_of_materials.bill() == bill
