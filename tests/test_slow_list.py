"""The lists of tests that the everyday loop leaves out, and of files that begin: they name what there is."""

import functools
import re
import subprocess
import sys
from pathlib import Path

HOME = Path(__file__).parents[1]


def listed(name):
    lines = (HOME / "tests" / name).read_text().splitlines()
    return [line for line in lines if not line.startswith("#")]


@functools.cache
def names_in(file):
    """Return the names of a file's functions and classes; none of a file that is gone."""
    text = (HOME / file).read_text() if (HOME / file).is_file() else ""
    return set(re.findall(r"^ *(?:def|class) (\w+)", text, re.MULTILINE))


def test_every_file_and_test_of_the_lists_is_one():
    gone = [file for file in listed("first.txt") if not (HOME / file).is_file()]
    for test in listed("slow.txt"):
        file, name, *_ = test.split("::")  # a class may inherit its tests
        if name not in names_in(file):
            gone.append(test)
    assert not gone, "renamed or moved: mend the list; or write tests/slow.txt anew with scripts/list_slow_tests.py"


def collected(*arguments):
    """Return the tests that pytest would run, without their parameters."""
    asked = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", *arguments]
    lines = subprocess.run(asked, capture_output=True, text=True, cwd=HOME).stdout.split("\n")
    return list(dict.fromkeys(line.split("[")[0] for line in lines if "::" in line))


def test_the_everyday_loop_leaves_them_out_and_the_listed_files_begin():
    begins, file = listed("first.txt")[-1], listed("slow.txt")[0].split("::")[0]
    tests, quick = (collected(file, begins, *more) for more in ((), ("--quick",)))
    assert set(tests) & set(listed("slow.txt"))
    assert quick == [test for test in tests if test not in listed("slow.txt")]
    assert tests[0].startswith(begins)
    assert tests[-1].startswith(file)
