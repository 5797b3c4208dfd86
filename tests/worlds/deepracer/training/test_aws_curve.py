"""The benchmark that sets `--preset aws` beside real trainings: how it reads curves, and, slowly, the proof itself."""

import importlib.util
import statistics
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


@pytest.mark.parametrize(
    ("evaluation", "reached"),
    [([100, 100, 85, 100], 1), ([100, 84, 100, 100, 86], 3), ([100, 100], None), ([0, 90, 97, 98, 100], 2)],
)
def test_a_curve_is_there_when_three_evaluations_in_a_row_average_enough(bench, evaluation, reached):
    assert bench.Curve("a", [], evaluation).reached == reached


def test_the_median_counts_a_seed_that_never_got_there_as_the_last(bench):
    there, not_there = bench.Curve("a", [], [100, 100, 100]), bench.Curve("b", [], [0, 0, 0])
    assert bench.median_reached([there, there, not_there]) == 1
    assert bench.median_reached([there, not_there, not_there]) is None


def test_the_real_curves_are_those_of_the_facts(bench):
    """Facts 10.3: 29 and 28 iterations; evaluations 3 20 2 8 and 14 6 10 8; 100 % from iteration 22 (from 0)."""
    curves = bench.real_curves()
    if not curves:
        pytest.skip("the reference traces do not lie beside the checkout")
    console, cloud = curves
    assert [round(value) for value in console.training[:6]] == [9, 8, 8, 8, 10, 10]
    assert [round(value) for value in console.evaluation[:4]] == [3, 20, 2, 8]
    assert [round(value) for value in cloud.evaluation[:4]] == [14, 6, 10, 8]
    assert (len(console.training), len(cloud.training)) == (29, 28)
    assert 15 <= statistics.median([console.reached, cloud.reached]) <= 30


@pytest.mark.long
def test_the_preset_learns_as_fast_as_the_original(bench, tmp_path):
    """Five seeds, an hour or two: the median reaches it where the real trainings did."""
    curves = bench.main(["--out", str(tmp_path)])
    assert bench.median_reached(curves) in bench.EXPECTED
    assert all(curve.steps / curve.seconds >= 250 for curve in curves)
