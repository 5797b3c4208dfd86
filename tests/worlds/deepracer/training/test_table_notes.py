import json

from racecraft.worlds.deepracer.training.plan import RaceRequest, known_lap_of, plan_car


def folder_with(tmp_path, actions):
    space = [{"steering_angle": angle, "speed": speed} for angle, speed in actions]
    metadata = {"action_space": space, "sensor": ["FRONT_FACING_CAMERA"], "version": "5"}
    (tmp_path / "model_metadata.json").write_text(json.dumps(metadata))
    return tmp_path


def test_a_training_says_before_it_begins_that_its_table_cannot_take_a_turn(tmp_path):
    folder = folder_with(tmp_path, [(-30, 4), (0, 4), (30, 4)])
    notes = plan_car(RaceRequest(folder=folder, track="reinvent_base")).notes
    assert any("turn 1 (left" in note and "sharper than any of these actions" in note for note in notes)


def test_a_training_with_a_table_that_races_hears_nothing_of_it(tmp_path):
    folder = folder_with(tmp_path, [(angle, speed) for angle in (-30, -10, 0, 10, 30) for speed in (1, 4)])
    notes = plan_car(RaceRequest(folder=folder, track="reinvent_base")).notes
    assert not any("actions" in note and "reinvent_base" in note for note in notes)


def test_the_best_known_lap_of_a_training_is_that_of_its_direction(monkeypatch):
    asked = []
    monkeypatch.setattr("racecraft.worlds.deepracer.training.plan.best_known_lap", lambda *key: asked.append(key))
    for reverse in ("false", "true"):
        known_lap_of(plan_car(RaceRequest(track="reinvent_base", overrides=(f"race.reverse={reverse}",))))
    assert [key[0] for key in asked] == ["reinvent_base"] * 2
    assert [key[3] for key in asked] == ["forward", "reverse"]
