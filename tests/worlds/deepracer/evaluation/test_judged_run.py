"""A car's run is judged by laps, on one track or several, by hand."""

from types import SimpleNamespace

import pytest

from racecraft.evaluation.evaluate_run import evaluate_run
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.evaluation import judged_run

POLICY = SimpleNamespace(checkpoint=SimpleNamespace(iteration=12), metadata={"settings": "its settings"})


@pytest.mark.parametrize(
    ("words", "named", "laps"),
    [
        ({}, "its own", 3),
        ({"laps": 2}, "its own", 2),
        ({"track": "Oval_track"}, "Oval_track", 3),
    ],
)
def test_a_car_is_judged_by_three_laps_from_the_start_line_of_its_track(tmp_path, monkeypatch, words, named, laps):
    run = RunFolder.create(tmp_path / "run", {"kind": "deepracer"})
    asked = []
    own = SimpleNamespace(name="its own")
    car = SimpleNamespace(
        policy=POLICY, trained_on=own, world=lambda track, **how: asked.append((track.name, how)) or "a world"
    )
    monkeypatch.setattr(judged_run, "load_trained_car", lambda path, which: asked.append(which) or car)
    report = SimpleNamespace(as_dictionary=lambda: {"full_laps": 1})
    monkeypatch.setattr(judged_run, "judge_laps", lambda *told: asked.append(told) or report)
    told = evaluate_run(run.path, **words)
    assert asked == [
        "best", (named, {"num_cars": 1, "start_shares": [0.0], "laps": laps}), (POLICY, "a world", laps)
    ]  # fmt: skip
    assert told == {"run": str(run.path), "checkpoint": 12, "track": named, "full_laps": 1}
