"""The page of what gradients of workers cost is made of what was measured, and its model is right by hand."""

import importlib.util
import json
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def bench():
    spec = importlib.util.spec_from_file_location("averaging_bench", HERE / "averaging.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["averaging_bench"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["averaging_bench"]


@pytest.fixture
def costs(bench):
    """Of figures made up here: 1 ms a row, 1 MB of weights."""
    return bench.Costs(row=1e-3, start=2e-3, worker=1e-3, step=3e-3, alone=4e-3, size=1e6)


def test_a_minibatch_by_hand(bench, costs):
    """100 rows of 4 workers: 25 ms, 2 + 3 ms and the latency, and for each worker 1 ms and 2 MB at 1 GB/s."""
    assert bench.lasts(costs, 100, 4, 1e9) == pytest.approx(0.025 + 0.005 + bench.LATENCY + 4 * 0.003)
    assert bench.lasts(costs, 100, 0, 1e9) == pytest.approx(0.104)


def test_the_best_number_of_workers_is_found(bench, costs):
    for rows in (1, 10, 100, 1_000):
        lasting = {workers: bench.lasts(costs, rows, workers, 1e9) for workers in range(100)}
        assert lasting[bench.best(costs, rows, 1e9)] == min(lasting.values())


def test_from_where_it_pays_both_last_as_long(bench, costs):
    rows = bench.pays_from(costs, 4, 1e9)
    assert bench.lasts(costs, rows, 4, 1e9) == pytest.approx(bench.lasts(costs, rows, 0, 1e9))


def test_the_page_says_what_was_measured(bench):
    results = json.loads((HERE / "averaging.json").read_text(encoding="utf-8"))
    assert (HERE / "averaging.md").read_text(encoding="utf-8") == bench.page(results)


def test_what_is_measured_is_a_training_of_ours(bench):
    costs, rows = bench.costs_of(bench.snake)
    assert rows == 2048
    assert costs.row > 0
    assert costs.size == sum(part.numel() * 4 for part in bench.snake().network.parameters())
