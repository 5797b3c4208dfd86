"""Which faults `racecraft reward check` names in rewards of public repositories, and which sound ones it flags.

    git clone https://github.com/OWNER/NAME FOLDER/OWNER+NAME      for each repository of public_rewards.json
    python benchmarks/public_rewards.py FOLDER

The list says which file of which commit was read, the fault that a reader finds in it (null: none), and the kind and
the line by which a finding names it.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from racecraft.contract.errors import RewardFileError
from racecraft.worlds.deepracer.driving.reward.check import check_reward
from racecraft.worlds.deepracer.driving.reward.findings import FAULT, Finding

LIST = Path(__file__).with_suffix(".json")


def main() -> None:
    """Check every file of the list."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    faulty, sound = [], []
    for row in json.loads(LIST.read_text(encoding="utf-8")):
        findings = check(folder, row)
        faults = [one for one in findings if one.level == FAULT]
        named = next((one for one in findings if (one.kind, one.line) == (row.get("kind"), row.get("line"))), None)
        if row["fault"] is None:
            sound.append(bool(faults))
            told = f"flagged: {faults[0].text}" if faults else "sound, no fault is named"
        else:
            faulty.append(named is not None)
            told = f"{row['fault']} | NOT NAMED" if named is None else f"{row['fault']} | {named.level}: {named.text}"
        print(f"{row['repository']} {row['file']} | {told}")
    print(f"\nNamed: {sum(faulty)} of {len(faulty)}. Sound, and flagged: {sum(sound)} of {len(sound)}.")


def check(folder: Path, row: dict[str, Any]) -> tuple[Finding, ...]:
    """Return what is found in a file of the list; of one that cannot be loaded, why."""
    clone, place = folder / row["repository"].replace("/", "+"), f"{row['commit']}:{row['file']}"
    text = subprocess.run(["git", "-C", str(clone), "show", place], check=True, capture_output=True).stdout
    with tempfile.TemporaryDirectory() as empty:
        path = Path(empty) / "reward_function.py"
        path.write_bytes(text)
        try:
            return tuple(check_reward(path).findings)
        except RewardFileError as error:
            return (Finding(FAULT, "refused", str(error.found), line=error.line),)


if __name__ == "__main__":
    main()
