"""What the form of a car offers: circuits, and the lap that a table of actions allows."""

import pytest

from racecraft.worlds.deepracer.actions.action_table import action_table
from racecraft.worlds.deepracer.console.car_look import look_at_actions
from racecraft.worlds.deepracer.console.circuits import circuits
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


def test_a_long_track_is_planned_only_where_it_is_asked_for_and_a_wrong_line_not_at_all():
    assert look_at_actions("0, 1\n5, 1", "Austin", False, None)["state"] == "unplanned"
    assert look_at_actions("0, much", "reinvent_base", False, None)["state"] == "unread"
