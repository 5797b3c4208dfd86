"""Checks of lesson 12, from simulation to the real car: they read a car's laps under each disturbance by itself."""

from __future__ import annotations

from typing import Any

from racecraft.lessons.checking import Answer, Verdict, passed, predicted, tried
from racecraft.worlds.deepracer.lessons.checks import material


def worst_disturbance(answer: Answer) -> Verdict:
    """A prediction: which of four disturbances costs the car most laps?"""
    answer.choice("worst")
    told = material("real.json")
    table = (("disturbance", f"laps of {told['tries']}"), [[row["disturbance"], row["laps"]] for row in told["rows"]])
    return predicted(answer, "reason", "acts_late", table)


def surely_worse(answer: Answer) -> Verdict:
    """Under how many disturbances by themselves the interval of laps lies below the undisturbed one."""
    undisturbed, *rows = material("real.json")["rows"]
    rows = [row for row in rows if row["disturbance"] != "all together"]
    sure = [row for row in rows if row["high"] < undisturbed["low"]]
    fewer = sum(row["laps"] < undisturbed["laps"] for row in rows)
    given = round(answer.number("count"))
    told: dict[str, Any] = {"count": len(sure), "fewer": fewer, "low": undisturbed["low"]}
    if given == len(sure):
        return passed(**told, names=", ".join(row["disturbance"] for row in sure))
    return tried("fewer_laps" if given == fewer else "other", **told, given=given)
