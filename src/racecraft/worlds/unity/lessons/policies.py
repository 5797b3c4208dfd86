"""Checks of lessons U2, U5 and U6: a pupil's environment, network, request and trained models are run."""

from __future__ import annotations

import json
import random
from typing import Any

from racecraft.lessons.checking import Answer, Verdict, compared, material, passed, predicted, tried
from racecraft.lessons.functions import call_function
from racecraft.worlds.unity.lessons import trained
from racecraft.worlds.unity.lessons.configuration import basic_learner
from racecraft.worlds.unity.lessons.network import decision

SOLVED = 0.92
NEAR = 0.1
"""The near prize: a policy that always goes left stays below it."""
NETWORKS = 50
CLOSE = 1e-6
LEARNERS = ("PPO", "PPO, 8 units", "DQN")
"""Of the recorded trainings."""
RECIPES = {
    "sums_alone": {"adds_bias": False, "bends": False}, "no_bias": {"adds_bias": False}, "no_tanh": {"bends": False},
}  # fmt: skip


def trainings() -> list[dict[str, Any]]:
    """Return the recorded trainings in Basic: learner, seed, and by evaluation steps and mean returns."""
    return list(material(__package__, "basic.json")["runs"])


def _steps_until(run: dict[str, Any], mean: float) -> int:
    """Return after how many steps a training was judged so good for the first time; each is, in the end."""
    return next(steps for steps, one in zip(run["steps"], run["means"], strict=True) if one >= mean)


def own_step(answer: Answer) -> Verdict:
    """The pupil's `step(place, action)` is Basic's, at every place and with every action."""
    from racecraft.worlds.unity.env.basic_scene import LARGE_GOAL, SMALL_GOAL

    cases = [(place, action) for place in range(SMALL_GOAL + 1, LARGE_GOAL) for action in range(3)]
    given = call_function(answer.code("code"), "step", cases)
    for (place, action), found in zip(cases, given, strict=True):
        if verdict := _unlike(place, action, found):
            return verdict
    return passed(count=len(cases))


def _unlike(place: int, action: int, found: Any) -> Verdict | None:
    """Return in what a step differs from the scene's; None: in nothing."""
    from racecraft.worlds.unity.env.basic_scene import START, STEP_REWARD
    from racecraft.worlds.unity.lessons.basic import play

    way = [1] * (START - place) + [2] * (place - START)
    after, reward = play([*way, action]), play([*way, action]).total - play(way).total
    at = {"place": place, "action": action}
    kinds = [int | float, int | float, bool]
    if not isinstance(found, list) or len(found) != 3 or not all(map(isinstance, found, kinds)):
        return tried("no_list", given=str(found)[:30], **at)
    if found[0] != after.place:
        return tried("moves", given=found[0], right=after.place, **at)
    if not abs(found[1] - reward) <= CLOSE:  # NaN is near nothing
        case = "penalty" if abs(found[1] + STEP_REWARD - reward) <= CLOSE else "pays"
        return tried(case, given=float(found[1]), right=reward, **at)
    if found[2] != after.ended:
        words = ("goes on", "ends")
        return tried("ends", given=words[found[2]], right=words[after.ended], **at)
    return None


def solves_basic(answer: Answer) -> Verdict:
    """A pupil's model reaches 0.92 in the mean of 20 greedy episodes."""
    found = _judged(answer)
    if found["mean"] >= SOLVED:
        return passed(**found)
    return tried("near_prize" if 0 < found["mean"] < NEAR else "not_yet", **found)


def _judged(answer: Answer) -> dict[str, Any]:
    found = trained.judged(answer.model("model"))
    return {"mean": found.mean, "episodes": trained.EPISODES, "algorithm": found.algorithm}


def first_prize(answer: Answer) -> Verdict:
    """A prediction: which prize do the recorded trainings bring first?"""
    rows = [(one["learner"], one["seed"], _steps_until(one, 0.0), _steps_until(one, SOLVED)) for one in trainings()]
    near = sum(first < last for *_, first, last in rows)
    return predicted(answer, "reason", "met_first", rows, near=near, count=len(rows))


def own_forward(answer: Answer) -> Verdict:
    """The pupil's `act(observation, layers)` decides as networks do that were drawn just now."""
    rng = random.Random()
    calls = [([rng.random() for _ in range(20)], [_layer(rng, 20, 8), _layer(rng, 8, 3)]) for _ in range(NETWORKS)]
    given = call_function(answer.code("code"), "act", calls)
    if odd := [one for one in given if one not in (0, 1, 2)]:
        return tried("no_action", given=str(odd[0])[:30])
    right = [decision(seen, layers) for seen, layers in calls]
    if given == right:
        return passed(all=NETWORKS)
    counts = {"count": sum(one == other for one, other in zip(given, right, strict=True)), "all": NETWORKS}
    for case, recipe in RECIPES.items():
        if given == [decision(seen, layers, **recipe) for seen, layers in calls]:
            return tried(case, **counts)
    return tried("other", **counts)


def _layer(rng: random.Random, inputs: int, sums: int) -> dict[str, Any]:
    return {
        "weights": [[rng.gauss(0, 1) for _ in range(inputs)] for _ in range(sums)],
        "bias": [rng.gauss(0, 1) for _ in range(sums)],
    }


def same_decisions(answer: Answer) -> Verdict:
    """A prediction: how many decisions of the ONNX file and of the endpoint differ from the checkpoint's?"""
    found = trained.compared(answer.model("model"))
    count = trained.QUESTIONS
    values = {"onnx": found.onnx, "endpoint": found.endpoint, "after": found.after, "count": count}
    return predicted(answer, "reason", "same", [(found.onnx, found.endpoint)], **values)


def own_question(answer: Answer) -> Verdict:
    """The pupil's `question(observation)` is read by the endpoint as what was observed."""
    import numpy as np

    from racecraft.serving.invocations import read_question
    from racecraft.web.errors import WebError
    from racecraft.web.json_api import ApiRequest

    rng = random.Random()
    observation = [round(rng.random(), 3) for _ in range(20)]
    (body,) = call_function(answer.code("code"), "question", [[observation]])
    request = ApiRequest("POST", "/invocations", json.dumps(body).encode(), 0.0, [])
    try:
        found = read_question(request, basic_learner().policy_spec)
    except WebError as error:
        return tried("refused", found=str(error))
    if found.rows != 1:
        return tried("many", rows=found.rows)
    (row,) = found.observations.values()
    return passed() if np.allclose(row[0], observation) else tried("changed")


def another_algorithm(answer: Answer) -> Verdict:
    """A pupil's model solves Basic, and something other than PPO has learned it."""
    found = _judged(answer)
    if found["algorithm"] == "ppo":
        return tried("same", **found)
    return passed(**found) if found["mean"] >= SOLVED else tried("not_yet", **found)


def fewest_steps(answer: Answer) -> Verdict:
    """A prediction: which learner solves Basic in the fewest steps, and do three seeds show it?"""
    steps = {name: [_steps_until(one, SOLVED) for one in trainings() if one["learner"] == name] for name in LEARNERS}
    rows = [(name, *found) for name, found in steps.items()]
    first, second = sorted(steps.values(), key=sum)[:2]
    right = "overlap" if max(first) >= min(second) else "apart"
    times = max(max(found) // min(found) for found in steps.values())
    return predicted(answer, "reason", right, rows, first=max(first), second=min(second), times=times)


def count_weights(answer: Answer) -> Verdict:
    """How many numbers an actor of eight units has; the network is made and counted."""
    network = basic_learner().network
    parts = [*network.policy_body.parameters(), *network.policy_head.parameters()]
    given, right = answer.number("count"), sum(one.numel() for one in parts)
    wrong = {"no_bias": sum(one.numel() for one in parts if one.ndim > 1), "units": 20 + 8 + 3, "product": 20 * 8 * 3}
    return compared(given, right, 0.0, wrong, count=round(given))
