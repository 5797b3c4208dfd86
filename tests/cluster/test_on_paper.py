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
    """Of figures made up here: by the clock one worker is half as fast as one process, and two twice as fast as one.

    By processor time 2,000 steps take one process 2 s; one worker 1.9 s, and the learner 2.1 s, 0.1 s to take in. The
    quickest of four iterations, of 1,000 steps for each worker's worlds, takes one worker 1 s, two 0.4 and 1.25 s.
    """

    def row(rate, workers=1, times=1, quick=1.0, **more):
        seconds = 1_000 * times / rate
        return {
            "iterations": 2,
            "steps": 2_000 * times,
            "collect": seconds,
            "learn": seconds,
            "workers": workers,
            "collects": [9.0, 9.0, quick, 9.0],
            **more,
        }

    told = {"busy": 2.0, "processor": 1.9, "here": 0.1, "own": 2.1, "bytes_in": 120.0, "bytes_out": 5_000.0}
    twice = {**told, "processor": 3.8, "here": 0.2, "own": 4.2}
    by = {
        "none": [row(1_000, own=2.0)],
        "1": [row(500, **told)],
        "2": [row(1_000, 2, quick=0.4, **told)],
        "2 of as many": [row(1_000, 2, 2, quick=1.25, **twice)],
    }
    machine = {"processor": "x", "system": "y", "cores": 2}
    results = {"machine": machine, "measured": "2026-01-01", "load": [0.5, 9.0], "rounds": 1, "worlds": {"cars": by}}
    results["twice"] = [1.9, 1.2, 1.5]
    text = bench.page(json.loads(json.dumps(results)))
    clock, rates = "| cars | clock |", "1,000 (1,000 – 1,000)"
    assert f"{clock} {rates} | 500 (500 – 500) | {rates} | {rates} | +100 % (+100 – +100) |" in text
    assert "| cars | processor | 1,000 (1,000 – 1,000) | 500 (500 – 500) | 656 (656 – 656) | 656 (656 – 656) |" in text
    assert f"{clock} 2.00× (2.00 – 2.00) | 2.00× (2.00 – 2.00) | 120 | 5 kB |" in text
    quick = "2.50× (2.50 – 2.50) | 1.60× (1.60 – 1.60)"
    assert f"| cars | clock, the quickest 25% of iterations | {quick} | 120 | 5 kB |" in text
    assert "did 1.50× (1.20 – 1.90) of what one of them does by itself" in text
    shared, own = 2.0 / (0.95 + 0.1), 2 * 2.0 / (1.9 + 0.2)
    assert (
        f"| cars | processor | {shared:.2f}× ({shared:.2f} – {shared:.2f}) | {own:.2f}× ({own:.2f} – {own:.2f}) |"
        in text
    )
    assert "| cars | 950.0 µs | 950.0 µs | 950.0 µs | 50.0 µs | 50.0 µs | 50.0 µs | 0.95 |" in text
    assert "| 1,000 | 16,000 |" in text


def test_two_processes_are_told_beside_one(bench, monkeypatch):
    monkeypatch.setattr(bench, "COUNTING", "print(3.0)")
    assert bench.twice() == 2.0


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
