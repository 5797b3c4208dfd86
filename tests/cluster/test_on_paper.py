"""The page of what a cluster does is made of what was measured, and its model is right by hand."""

import importlib.util
import json
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def bench():
    spec = importlib.util.spec_from_file_location("cluster_bench", HERE / "benchmarks" / "cluster.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["cluster_bench"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["cluster_bench"]


def test_the_page_says_what_was_measured(bench):
    """Of figures made up here: one worker half as fast as one process, two twice as fast as one."""

    def row(rate, **more):
        return {"iterations": 2, "steps": 2_000, "collect": 1_000 / rate, "learn": 1_000 / rate, **more}

    told = {"busy": 0.5, "bytes_in": 120.0, "bytes_out": 5_000.0}
    by = {"none": [row(1_000)], "1": [row(500, **told)], "2": [row(1_000, **told)]}
    machine = {"processor": "x", "system": "y", "cores": 2}
    results = {"machine": machine, "measured": "2026-01-01", "load": [0.5, 9.0], "rounds": 1, "worlds": {"cars": by}}
    text = bench.page(json.loads(json.dumps(results)))
    assert "| cars | 1,000 (1,000 – 1,000) | 500 (500 – 500) | 1,000 (1,000 – 1,000) |" in text
    assert "+100 % (+100 – +100) | 2.00× (2.00 – 2.00) | 120 | 5 kB |" in text
    assert "| 1,000 | 16,000 |" in text


def test_a_node_on_paper_by_hand(bench):
    """1,000 steps of 100 us; 500 bytes each over 1e9 a second; 10 us to learn: two workers make 2,000 in 121 ms."""
    costs = bench.Costs(collect=1e-4, take_in=0.0, learn=1e-5, bytes_in=500.0, bytes_out=0.0, steps=1_000)
    one = bench.on_paper(costs, nodes=1, cores=2, link=1e9)
    assert one.rate == pytest.approx(2_000 / 0.121)
    assert one.waits == pytest.approx(0.021 / 0.121)
    assert one.link == pytest.approx(0.001 / 0.121)
    assert one.memory == 1e6
    assert bench.breaks_at(costs, link=1e9) == pytest.approx(1e-4 / (1e-5 + 5e-7), rel=1e-5)


def test_weights_pass_the_link_once_a_worker_and_iteration(bench):
    costs = bench.Costs(collect=1e-4, take_in=0.0, learn=0.0, bytes_in=0.0, bytes_out=1e6, steps=1_000)
    assert bench.on_paper(costs, nodes=10, cores=10, link=1e9).link == pytest.approx(0.1 / 0.2)
