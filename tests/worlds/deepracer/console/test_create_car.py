"""What the form of a car offers: circuits, and the lap that a table of actions allows."""

import json

import pytest

from racecraft.formats.run_folder import HYPERPARAMETERS, MODEL_METADATA, RunFolder
from racecraft.worlds.deepracer.actions.action_table import action_table
from racecraft.worlds.deepracer.console.car_form import defaults
from racecraft.worlds.deepracer.console.car_look import look_at_actions
from racecraft.worlds.deepracer.console.car_values import files, values_of
from racecraft.worlds.deepracer.console.circuits import circuits
from racecraft.worlds.deepracer.files.model_metadata import NETWORKS
from racecraft.worlds.deepracer.tracks.catalogue import names


def test_each_track_stands_on_one_card_and_the_shortest_loop_first():
    cards = circuits()
    offered = [name for card in cards for name, _ in card["tracks"]]
    assert sorted(offered) == sorted(names())
    assert len(cards) == 62
    assert cards[0]["length"] == min(card["length"] for card in cards if "open" not in card["directions"])
    speedway = next(card for card in cards if card["title"] == "A to Z Speedway")
    assert [what for _, what in speedway["tracks"]] == ["plain", "counter-clockwise", "clockwise", "mirrored"]
    assert (speedway["directions"], speedway["year"]) == (["ccw", "cw"], "2019")


def test_the_lap_beside_the_plot_is_that_of_the_command():
    shown = look_at_actions("-30, 2.5\n0, 2.5\n30, 2.5", "Straight_track", False, None)
    told = action_table(["Straight_track"], table="3x2.5")
    assert shown["state"] == "planned"
    assert shown["lap"] == pytest.approx(told["laps_seconds"]["Straight_track"])
    free = look_at_actions("-30 to 30, 0.5 to 2.5", "Straight_track", False, None)
    assert free["lap"] == pytest.approx(shown["lap"], rel=0.02), "straight on, as fast"


def test_a_long_track_is_planned_only_where_it_is_asked_for_and_a_wrong_line_not_at_all():
    assert look_at_actions("0, 1\n5, 1", "Austin", False, None)["state"] == "unplanned"
    for text in ("0, much", "-30 to 31, 1 to 2", "-30 to 30, 1 to", "30 to 9, 1 to 2"):
        assert look_at_actions(text, "reinvent_base", False, None)["state"] == "unread"


def test_a_clone_learns_as_its_model_did_and_defaults_replace_what_a_file_held(tmp_path):
    job = {"format": "racecraft run", "version": 1, "settings": {"bots": {"number": 2, "random": False, "speed": 0.7}}}
    (tmp_path / "job.json").write_text(json.dumps(job))
    (tmp_path / HYPERPARAMETERS).write_text(files({"lr": 0.0005, "loss_type": "huber"})[HYPERPARAMETERS])
    values = values_of(RunFolder(tmp_path))
    expected = {"lr": 0.0005, "loss_type": "huber", "num_epochs": defaults()["num_epochs"], "bot_speed": 0.7}
    assert {name: values[name] for name in expected} == expected
    assert json.loads(files(defaults())[HYPERPARAMETERS]) == {}


def test_a_clone_keeps_what_the_form_does_not_ask_for(tmp_path):
    ranges = {"steering_angle": {"low": -20.0, "high": 25.0}, "speed": {"low": 0.5, "high": 2.0}}
    car = {"sensor": ["FRONT_FACING_CAMERA"], "neural_network": NETWORKS[1], "version": "4", "mine": 1}
    metadata = {**car, "action_space": ranges, "action_space_type": "continuous", "training_algorithm": "clipped_ppo"}
    job = {"format": "racecraft run", "version": 1, "algorithm": "ppo", "model_metadata": metadata}
    (tmp_path / "job.json").write_text(json.dumps(job))
    (tmp_path / HYPERPARAMETERS).write_text('{"lr": 0.0005, "num_episodes_between_training": 20}')
    made = files(values_of(RunFolder(tmp_path)))
    assert json.loads(made[MODEL_METADATA]) == metadata
    assert json.loads(made[HYPERPARAMETERS]) == {"lr": 0.0005, "num_episodes_between_training": 20}
