"""The page of benchmarks is made of the figures that stand beside it."""

import importlib.util
import json
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parents[1] / "benchmarks"
RESULTS = json.loads((HERE / "results.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def run_all():
    sys.path.insert(0, str(HERE))
    try:
        spec = importlib.util.spec_from_file_location("run_all", HERE / "run_all.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        yield module
    finally:
        sys.path.remove(str(HERE))


def test_the_page_is_made_of_the_figures_beside_it(run_all):
    assert (HERE / "README.md").read_text(encoding="utf-8") == run_all.page(RESULTS)
