"""A run of a scene is judged by whole episodes of that scene, by hand."""

import json
import os
from types import SimpleNamespace

import pytest

from racecraft.evaluation.evaluate_run import evaluate_run
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.unity import evaluation

POLICY = SimpleNamespace(checkpoint=SimpleNamespace(iteration=12), metadata={"settings": "its settings"})


@pytest.mark.parametrize(
    ("asked", "words", "made", "played"),
    [
        ({"behavior": "Basic", "build": "builtin:Basic"}, {}, ("Basic", False, 0, ("--agents", "20")), (20, 0)),
        ({"behavior": ["Basic"], "build": "builtin:Basic"}, {"episodes": 3, "seed": 4},
         ("Basic", False, 4, ("--agents", "3")), (3, 4)),
        ({"behavior": ["A", "B"], "build": "x.app"}, {}, (["A", "B"], True, 0, None), (20, 0)),
        ({"behavior": "A", "build": "builtin:Basic", "env_args": ["--many"]}, {},
         ("A", False, 0, ("--many",)), (20, 0)),
    ],
)  # fmt: skip
def test_a_scene_is_judged_by_twenty_episodes_as_it_was_trained(tmp_path, monkeypatch, asked, words, made, played):
    run = RunFolder.create(tmp_path / "run", {"kind": "unity", "asked": asked})
    (run.evaluations / "1.json").write_text('{"most_steps": 70}')
    seen = []

    class Scene:
        def __init__(self, build, behavior, several, seed, args=None):
            seen.append((build, (behavior, several, seed, args)))

        def close(self):
            seen.append("closed")

    def judged(policy, world, episodes, seed, most_steps):
        seen.append((policy, episodes, seed, most_steps))
        return {"episodes": episodes}

    monkeypatch.setattr(evaluation, "find_build", lambda name: f"<{name}>")
    monkeypatch.setattr(evaluation, "UnityWorld", Scene)
    monkeypatch.setattr(evaluation, "load_policy", lambda run, which: POLICY)
    monkeypatch.setattr(evaluation, "judge_episodes", judged)
    assert evaluate_run(run.path, **words) == {"run": str(run.path), "checkpoint": 12, "episodes": played[0]}
    assert seen == [(f"<{asked['build']}>", made), (POLICY, *played, 70), "closed"]


def test_patience_is_what_the_latest_evaluation_that_tells_it_had(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "unity"})
    assert evaluation._patience_of(run) is None
    for age, (name, text) in enumerate({
        "newest": "no json", "newer": "[3]", "none": '{"most_steps": 0}', "words": '{"most_steps": "9"}',
        "this": json.dumps({"most_steps": 1}), "older": '{"most_steps": 70}',
    }.items()):  # fmt: skip
        (run.evaluations / f"{name}.json").write_text(text)
        os.utime(run.evaluations / f"{name}.json", (1000 - age, 1000 - age))
    assert evaluation._patience_of(run) == 1
    (run.evaluations / "this.json").unlink()
    assert evaluation._patience_of(run) == 70
