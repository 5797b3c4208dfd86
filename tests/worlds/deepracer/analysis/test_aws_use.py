"""A car's bill, summed by hand: 57,600 steps ÷ 8 a second are 7,200 s, two hours of simulation."""

import pytest

from racecraft.analysis.aws_cost import run_costs, total_usd
from racecraft.analysis.run_facts import read_facts
from racecraft.formats.run_folder import RunFolder


def bill(path, steps, **job):
    """Return what a car's run of so many steps would have cost, by service."""
    run = RunFolder.create(path, {"kind": "deepracer", **job})
    run.append_metrics({"iteration": 1, "steps": steps, "seconds": 60.0})
    costs = run_costs(read_facts(run))
    return [line.usd for line in costs], total_usd(costs)


@pytest.mark.parametrize(
    ("workers", "lines", "total"),
    [
        (1, [1.20, 4.80, 0.0, 1.0, 0.20], 7.20),  # 2 h × 0.60, 12 unit hours × 0.40, no notebook, a day, 20 GB × 0.010
        (4, [0.30, 4.80, 0.0, 1.0, 0.20], 6.30),  # four simulations side by side: half an hour of training
    ],
)
def test_two_hours_of_simulation(tmp_path, workers, lines, total):
    told, summed = bill(tmp_path / "run", 57_600, cluster={"asked": "4", "workers": workers, "machines": 1})
    assert told == pytest.approx(lines)
    assert summed == pytest.approx(total)


def test_a_gateway_is_paid_by_the_day_that_is_begun(tmp_path):
    (_, _, _, gateway, _), _ = bill(tmp_path / "run", 8 * 3600 * 25)
    assert gateway == 2.0
