"""Checks of lesson 10, the family: one number by hand of DQN, replay, SAC, evolution and search each, computed anew."""

from __future__ import annotations

from racecraft.lessons.checking import Answer, Verdict, compared, material, passed, predicted, tried
from racecraft.lessons.models.family import at_temperature, priorities, search_scores, slope_by_trying

Q, REWARD, GAMMA, STEP = 1.0, 0.5, 0.9, 0.5
LOCAL, TARGET = 2.0, 1.0
"""Best value of the next state, as the local and as the target network tell it."""
ERRORS, EXPONENT = (2.0, 1.0, 0.5, 0.1), 0.6
VALUES = (10.1, 12.0, 10.1)
ASKED = 0.6
SIGMA = 0.25
VISITS, WORTHS, PRIORS, C = (6, 3, 1), (0.5, 0.4, 0.1), (0.5, 0.3, 0.2), 1.5
NEAR = 0.02


def dqn_update(answer: Answer) -> Verdict:
    """One update of Q-learning whose target is told by the target network."""
    given, local = answer.number("value"), _updated(LOCAL)
    wrong = {
        "local_network": local, "no_discount": Q + STEP * (REWARD + TARGET - Q), "whole_step": REWARD + GAMMA * TARGET,
    }  # fmt: skip
    return compared(given, _updated(TARGET), 0.005, wrong, value=given, local=local)


def target_off(answer: Answer) -> Verdict:
    """A prediction: what becomes of DQN on CartPole where the target network is copied at every update?"""
    rows = material("racecraft.lessons", "target.json")["rows"]
    return predicted(answer, "reason", "own_guess", [(row["copied_every"], row["seed"], row["mean"]) for row in rows])


def _updated(best_next: float) -> float:
    return Q + STEP * (REWARD + GAMMA * best_next - Q)


def priority(answer: Answer) -> Verdict:
    """How often the step with the largest error is replayed, and the one with the smallest, per cent."""
    given = answer.number("largest"), answer.number("smallest")
    right, no_exponent, all_alike = (
        [100 * shares[at] for at in (0, -1)] for shares in (priorities(ERRORS, power) for power in (EXPONENT, 1.0, 0.0))
    )
    wrong = {"no_exponent": no_exponent, "all_alike": all_alike}
    return compared(given, right, 1.0, wrong, names=("largest", "smallest"))


def temperature(answer: Answer) -> Verdict:
    """The temperature at which the best action has 60 %."""
    given = answer.number("temperature")
    share = max(at_temperature(VALUES, given))
    if abs(share - ASKED) <= 0.01:
        return passed(temperature=given, share=100 * share)
    return tried("too_even" if share < ASKED else "too_sure", temperature=given, share=100 * share)


def evolution(answer: Answer) -> Verdict:
    """The slope of F = -(θ - 3)² at θ = 0 from a pair of tries at ±0.25."""
    given, right = answer.number("slope"), slope_by_trying(_fitness, 0.0, SIGMA)
    difference = _fitness(SIGMA) - _fitness(-SIGMA)
    wrong = {"difference": difference, "no_width": difference / 2, "turned_round": -right}
    return compared(given, right, 0.02, wrong, slope=given)


def _fitness(theta: float) -> float:
    return -((theta - 3) ** 2)


def tried_next(answer: Answer) -> Verdict:
    """The smallest prior of the second move at which search tries it next."""
    given = answer.number("prior")
    first, second, _ = search_scores(WORTHS, (PRIORS[0], given, PRIORS[2]), VISITS, C)
    _, smaller, _ = search_scores(WORTHS, (PRIORS[0], given - NEAR, PRIORS[2]), VISITS, C)
    if second <= first:
        return tried("still_first", first=first, second=second)
    if smaller > first:
        return tried("more_than_needed", first=first, second=second)
    return passed(first=first, second=second)
