import json
import math

import numpy as np
import pytest

from racecraft.worlds.deepracer.driving.action_design import design_ranges, design_table
from racecraft.worlds.deepracer.driving.action_tables import default_table, read_table
from racecraft.worlds.deepracer.driving.demand import find_turns, table_warning, turns_beyond, unused_actions
from racecraft.worlds.deepracer.driving.log_actions import chosen_actions
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.vehicle import MAX_STEERING_RAD, PROFILES
from racecraft.worlds.deepracer.tracks.catalogue import load_track

HEADER = (
    "episode,steps,X,Y,yaw,steer,throttle,action,reward,done,all_wheels_on_track,progress,closest_waypoint,"
    "track_len,tstamp,episode_status,pause_duration,obstacle_crash_counter"
)


@pytest.fixture(scope="module")
def track():
    return load_track("reinvent_base")


def test_turns_are_those_of_the_track_in_order(track):
    turns = find_turns(track, PROFILES["v6"])
    assert [turn.number for turn in turns] == list(range(1, len(turns) + 1))
    assert 3 <= len(turns) <= 7
    assert sum(turn.curvature < 0 for turn in turns) == 1  # reinvent_base bends to the right once
    assert [turn.waypoint for turn in turns] == sorted(turn.waypoint for turn in turns)


def test_a_table_that_steers_to_one_side_cannot_take_turns_to_the_other(track):
    turns = find_turns(track, PROFILES["v6"])
    left = ActionTable.of([(math.radians(angle), 1.5) for angle in (0, 15, 30)])
    assert turns_beyond(PROFILES["v6"], left, turns) == [turn for turn in turns if turn.curvature < 0]


def test_full_lock_that_is_too_fast_is_told_and_a_slower_one_is_not(track):
    car = PROFILES["v5-classic"]
    assert "is sharper than any" in table_warning(track, "v5-classic", car, read_table("7x4"))
    assert table_warning(track, "v5-classic", car, read_table("7x1,2.2,4")) is None


def test_a_crawling_table_is_told_and_a_racing_one_is_not(track):
    car = PROFILES["v6"]
    assert "a lap of reinvent_base at best" in table_warning(track, "v6", car, read_table("default"))
    assert table_warning(track, "v6", car, read_table(default_table("v6", 2.5))) is None


def test_actions_without_a_choice_are_named():
    table = ActionTable.of([(-MAX_STEERING_RAD, 1.0), (0.0, 2.0), (MAX_STEERING_RAD, 1.0)])
    assert unused_actions(table, np.array([3, 0, 1])) == ["straight at 2 m/s"]


def test_a_log_tells_which_actions_of_its_table_were_never_chosen(tmp_path):
    space = [{"steering_angle": angle, "speed": 1.0} for angle in (-30, -10, 0, 10, 30)]
    (tmp_path / "model_metadata.json").write_text(
        json.dumps({"action_space": space, "sensor": ["FRONT_FACING_CAMERA"]})
    )
    rows = [
        f"0,{step}.0,0.1,0.9,0.0,{space[action]['steering_angle']},1.0,{action},1.0,False,True,{step},1,17.67,"
        f"{100 + step / 15:.3f},in_progress,0.0,0"
        for step, action in enumerate([0, 0, 2, 2, 0, 2], 2)
    ]
    folder = tmp_path / "training-simtrace"
    folder.mkdir()
    (folder / "0-iteration.csv").write_text("\n".join([HEADER, *rows]) + "\n")
    chosen = chosen_actions(tmp_path)
    assert chosen.ticks == 6
    assert list(chosen.counts) == [3, 0, 3, 0, 0]
    assert chosen.never == ["right 10° at 1 m/s", "left 10° at 1 m/s", "left 30° at 1 m/s"]


def test_a_designed_table_keeps_to_its_size_and_speed_and_is_driven(track):
    design = design_table([track], PROFILES["v6"], 2.5, 6)
    assert len(design.actions.steering) <= 6
    assert max(design.actions.speed) == 2.5
    assert design.laps[0] < 6.2


def test_designed_ranges_are_symmetric_and_reach_the_top_speed(track):
    design = design_ranges([track], PROFILES["v6"], 2.5)
    assert design.actions.steering[0] == -design.actions.steering[1]
    assert design.actions.speed[1] == 2.5
    assert design.laps[0] < 6.2
