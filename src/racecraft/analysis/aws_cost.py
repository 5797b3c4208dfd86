"""What a run would have cost on AWS, service by service: an estimate. Begin with `run_costs`.

A world says through its kind's `aws_use` what it would have used there; the prices are those that a racer was billed in
2019, and that AWS's support then wrote to that racer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from racecraft.analysis.page_part import PagePart
from racecraft.analysis.run_facts import RunFacts
from racecraft.pages.filters import number
from racecraft.pages.parts import card, paragraph, terms


@dataclass(frozen=True)
class AwsPrice:
    """What a unit of a service cost."""

    service: str
    unit: str
    usd: float | None
    """US dollars a unit; None: the source names no price."""
    source: str
    """Where the price is from."""


TRAINING = AwsPrice("training (SageMaker)", "h", 0.60, "AWS's credit: 6 USD for 10 h")
SIMULATION = AwsPrice("simulation (RoboMaker)", "unit hours", 0.40, "AWS's credit: 24 USD for 60 unit hours")
NOTEBOOK = AwsPrice("notebook (SageMaker)", "h", None, "no source names its price")
NAT = AwsPrice("NAT gateway", "days", 1.00, "a bill: 1 USD a day, used or not")
TRANSFER = AwsPrice("data transfer", "GB", 0.010, "a bill: 0.010 USD a GB between zones")
HEADING = "What it would have cost on AWS"
ESTIMATE = "An estimate: amounts are reckoned, prices are of 2019; today's prices, taxes and storage are not in it."


@dataclass(frozen=True, kw_only=True)
class AwsUse:
    """What a training would have used of AWS's services, and how that was reckoned."""

    training_hours: float
    """Hours of training instances, all of them together."""
    simulation_unit_hours: float = 0.0
    """Hours of RoboMaker's simulation units."""
    notebook_hours: float = 0.0
    """Hours of the notebook instance that a training is begun from."""
    nat_days: int = 0
    """Days of a NAT gateway; a day that is begun counts."""
    transfer_gigabytes: float = 0.0
    """Between zones."""
    how: str
    """Sentences: what the amounts are reckoned from, and what of it is assumed."""


@dataclass(frozen=True)
class ServiceCost:
    """A line of the bill."""

    service: str
    amount: float
    unit: str
    usd_per_unit: float | None
    usd: float | None
    """None: something was used whose price is not known."""
    source: str


def costs_of(use: AwsUse) -> tuple[ServiceCost, ...]:
    """Return the bill for what was used, a line a service.

    >>> [line.usd for line in costs_of(AwsUse(training_hours=10, simulation_unit_hours=60, how=""))]
    [6.0, 24.0, 0.0, 0.0, 0.0]
    """
    amounts = (
        (TRAINING, use.training_hours),
        (SIMULATION, use.simulation_unit_hours),
        (NOTEBOOK, use.notebook_hours),
        (NAT, float(use.nat_days)),
        (TRANSFER, use.transfer_gigabytes),
    )
    return tuple(_line(price, amount) for price, amount in amounts)


def _line(price: AwsPrice, amount: float) -> ServiceCost:
    usd = 0.0 if not amount else None if price.usd is None else amount * price.usd
    return ServiceCost(price.service, amount, price.unit, price.usd, usd, price.source)


def total_usd(costs: Sequence[ServiceCost]) -> float:
    """Return the sum of the lines whose price is known, in US dollars."""
    return sum(line.usd for line in costs if line.usd is not None)


def run_costs(facts: RunFacts) -> tuple[ServiceCost, ...]:
    """Return what a run with metrics would have cost, a line a service."""
    return costs_of(_use_of(facts))


def cost_part(facts: RunFacts) -> PagePart:
    """Return the part of a report that tells what a run with metrics would have cost."""
    use = _use_of(facts)
    costs = costs_of(use)
    unknown = [line.service for line in costs if line.usd is None]
    told = f"About {total_usd(costs):,.2f} USD on AWS{f', without the {unknown[0]}' if unknown else ''}."
    lines = terms([(line.service, _money(line.usd), _reckoned(line)) for line in costs])
    return PagePart(HEADING, [card(paragraph(told, "strong"), lines, paragraph(f"{use.how} {ESTIMATE}", "quiet"))])


def _money(usd: float | None) -> str:
    return "not known" if usd is None else number(usd, 2, "USD")


def _reckoned(line: ServiceCost) -> str:
    """Return how a line came about: "2.00 h × 0.60 USD (AWS's credit: 6 USD for 10 h)"."""
    if not line.amount:
        return "Not used."
    amount = number(line.amount, 2, line.unit)
    if line.usd_per_unit is None:
        return f"{amount}; {line.source}"
    return f"{amount} × {line.usd_per_unit:.2f} USD ({line.source})"


def _use_of(facts: RunFacts) -> AwsUse:
    of_world = facts.kind.piece("aws_use")
    use: AwsUse = of_world(facts) if of_world else training_alone(facts)
    return use


def training_alone(facts: RunFacts) -> AwsUse:
    """Return the use of a training whose worlds are stepped where it learns: instances, and the notebook it began in.

    Every machine of a cluster is an instance, for as long as the training took here.
    """
    hours = facts.metrics[-1]["seconds"] / 3600.0
    machines = (facts.job.get("cluster") or {}).get("machines", 1)
    instances = "one instance" if machines == 1 else f"{machines} instances, one for each machine of the cluster,"
    how = (
        f"Reckoned as {instances} for the {hours:.2f} h that it took here, as fast as here, and a notebook instance "
        "beside; worlds that are stepped where it learns need no simulation service, gateway or transfer."
    )
    return AwsUse(training_hours=hours * machines, notebook_hours=hours, how=how)
