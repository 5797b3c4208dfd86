"""The page of Ape-X with killed workers is made of what was measured, and judges by it."""

import importlib.util
import json
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def bench():
    spec = importlib.util.spec_from_file_location("apex_kills_bench", HERE / "apex_kills.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["apex_kills_bench"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["apex_kills_bench"]


def test_the_page_is_made_of_the_figures_beside_it(bench):
    results = json.loads((HERE / "apex_kills.json").read_text(encoding="utf-8"))
    assert (HERE / "apex-kills.md").read_text(encoding="utf-8") == bench.page(results)


def test_runs_are_within_seeds_where_their_median_lies_among_those_that_nothing_happened_to(bench):
    assert bench.judged([1.0, 5.0, 9.0], [2.0, 8.0, 100.0]) == "within seeds"
    assert bench.judged([1.0, 5.0, 9.0], [10.0, 11.0, 2.0]) == "not within seeds"
    assert bench.judged([1.0, 5.0, 9.0], [0.0, 0.5, 9.0]) == "not within seeds"
    assert bench.late({"curve": [[1, 900.0], [2, 1.0], [3, 2.0], [4, 3.0], [5, 6.0]]}) == 3.0
