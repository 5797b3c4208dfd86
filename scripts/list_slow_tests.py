"""Write down which tests `make quick` leaves out: those that take long, by the report of a run that told durations.

    python -m pytest -n 2 --dist loadfile --durations=0 > report.txt
    python scripts/list_slow_tests.py report.txt

A test's parameters count together. What is left out is still run by `make test`.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

HOME = Path(__file__).parents[1]
SLOW = HOME / "tests" / "slow.txt"
LONGEST_S = 0.1
_LINE = re.compile(r"(\d+\.\d+)s (?:call|setup|teardown) +(\S+?::[^\[\s]+)")


def main() -> None:
    """Read the report and write the list."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=Path, help="what pytest printed with --durations=0")
    parser.add_argument("--seconds", type=float, default=LONGEST_S, help=f"longest that stays ({LONGEST_S})")
    asked = parser.parse_args()
    seconds = seconds_of(asked.report.read_text(encoding="utf-8").splitlines())
    slow = sorted(test for test, taken in seconds.items() if taken > asked.seconds)
    left = sum(seconds[test] for test in slow)
    heading = (
        f"# Tests of more than {asked.seconds:g} s, which `make quick` leaves out; from scripts/list_slow_tests.py\n"
    )
    SLOW.write_text(heading + "".join(f"{test}\n" for test in slow), encoding="utf-8")
    print(f"{len(slow)} of {len(seconds)} tests left out, {left:.0f} of {sum(seconds.values()):.0f} s: {SLOW}")


def seconds_of(report: Iterable[str]) -> Counter[str]:
    """Return how long each test took, its parameters, preparation and tidying together."""
    seconds: Counter[str] = Counter()
    for line in report:
        if match := _LINE.match(line.strip()):
            seconds[match[2]] += float(match[1])  # type: ignore[assignment]
    return seconds


if __name__ == "__main__":
    main()
