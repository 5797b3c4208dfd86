"""The preset `aws` learns as fast as real trainings did, slowly proved by the benchmark that sets them side by side."""

import importlib.util
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[4]
HERE = ROOT / "benchmarks" / "aws_curve.py"


@pytest.fixture(scope="module")
def bench():
    spec = importlib.util.spec_from_file_location("aws_curve", HERE)
    module = importlib.util.module_from_spec(spec)
    sys.modules["aws_curve"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.long
def test_the_preset_learns_as_fast_as_the_original(bench, tmp_path):
    """Five seeds, an hour or two: the median reaches it where the real trainings did."""
    curves = bench.main(["--out", str(tmp_path)])
    assert bench.median_reached(curves) in bench.EXPECTED
    assert all(curve.steps / curve.seconds >= 250 for curve in curves)
