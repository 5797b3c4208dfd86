"""What a car's training would have used of AWS's services. Begin with `aws_use`."""

from __future__ import annotations

import math

from racecraft.analysis.aws_cost import AwsUse
from racecraft.analysis.run_facts import RunFacts
from racecraft.pages.filters import duration

STEPS_PER_SECOND = 8.0
"""What the original trains, everything in (facts: its own logs, 10,693 steps in 1,338 s)."""
UNITS = 6.0
"""RoboMaker's units of one simulation; AWS's support: "a typical simulation uses up to six"."""
GIGABYTES_PER_HOUR = 10.0
"""Transferred for an hour of simulation: a bill of 2019 has 5 GB beside 0.30 USD, half an hour, of training."""
CONSOLE_USD_PER_HOUR = 3.50
"""The console's flat price of a later day (AWS's price list of 2021)."""


def aws_use(facts: RunFacts) -> AwsUse:
    """Return what as many steps as the run counts would have used; workers of a cluster are simulations side by side.

    hours of simulation = steps / STEPS_PER_SECOND / 3600; hours of training = that / workers.
    """
    last = facts.metrics[-1]
    workers = (facts.job.get("cluster") or {}).get("workers", 1)
    simulated = last["steps"] / STEPS_PER_SECOND / 3600.0
    hours = simulated / workers
    return AwsUse(
        training_hours=hours,
        simulation_unit_hours=UNITS * simulated,
        nat_days=max(1, math.ceil(hours / 24.0)),
        transfer_gigabytes=GIGABYTES_PER_HOUR * simulated,
        how=_how(last["steps"], last["seconds"], simulated, workers),
    )


def _how(steps: int, seconds_here: float, simulated: float, workers: int) -> str:
    """Return what the amounts are reckoned from; `simulated` in hours."""
    shared = f", shared by {workers} simulations" if workers > 1 else ""
    console = simulated / workers * CONSOLE_USD_PER_HOUR
    return (
        f"{steps:,} steps ÷ {STEPS_PER_SECOND:g} steps a second ÷ 3,600 = {simulated:.2f} h of simulation{shared}: "
        f"{duration(3600 * simulated / workers)} of training; here it took {duration(seconds_here)}. A simulation "
        f"takes {UNITS:g} units and moves about {GIGABYTES_PER_HOUR:g} GB an hour; the gateway is paid by the day "
        "until it is deleted; the console needs no notebook. Equal steps are compared, not equal skill; evaluations "
        f"do not count as steps. Later the console had one price, {CONSOLE_USD_PER_HOUR:.2f} USD an hour: "
        f"{console:,.2f} USD."
    )
