"""The list of tests that the everyday loop leaves out: it names tests that there are, and they are left out."""

import ast
import subprocess
import sys
from pathlib import Path

from scripts.list_slow_tests import SLOW, seconds_of

HOME = Path(__file__).parents[1]


def slow_tests():
    return [line for line in SLOW.read_text().splitlines() if not line.startswith("#")]


def test_every_test_of_the_list_is_one():
    gone = []
    for test in slow_tests():
        file, name, *_ = test.split("::")  # a class may inherit its tests
        written = ast.walk(ast.parse((HOME / file).read_text())) if (HOME / file).is_file() else ()
        names = {node.name for node in written if isinstance(node, ast.FunctionDef | ast.ClassDef)}
        if name not in names:
            gone.append(test)
    assert not gone, "renamed or moved: mend tests/slow.txt, or write it anew with scripts/list_slow_tests.py"


def collected(*arguments):
    """Return the tests that pytest would run, without their parameters."""
    asked = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", *arguments]
    lines = subprocess.run(asked, capture_output=True, text=True, cwd=HOME).stdout.split("\n")
    return {line.split("[")[0] for line in lines if "::" in line}


def test_the_everyday_loop_leaves_them_out():
    file = slow_tests()[0].split("::")[0]
    tests, quick = (collected(file, *more) for more in ((), ("--quick",)))
    left_out = tests & set(slow_tests())
    assert left_out
    assert quick == tests - left_out


def test_a_report_tells_what_each_test_took_with_all_its_parameters():
    report = """
============================= slowest durations ==============================
1.50s call     tests/a/test_b.py::test_c[1-x y]
0.25s setup    tests/a/test_b.py::test_c[2]
0.02s call     tests/a/test_b.py::test_d
(3 durations < 0.005s hidden.  Use -vv to show these durations.)
    """
    assert seconds_of(report.split("\n")) == {"tests/a/test_b.py::test_c": 1.75, "tests/a/test_b.py::test_d": 0.02}
