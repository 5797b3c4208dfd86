"""A person's laps: driven tick by tick, kept in a file, and learned from."""

import math

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.formats.demonstrations import read_demonstrations
from racecraft.formats.tensor_file import CheckpointError
from racecraft.worlds.deepracer.driving.by_hand import HandDrive
from racecraft.worlds.deepracer.driving.driven_laps import DrivenLaps
from racecraft.worlds.deepracer.training.driven_world import world_by_hand

TRACK = "reinvent_base"


def steer(track, moment):
    """Return how a calm person turns the wheel: towards the centre line a metre ahead."""
    ahead = track.pose_at(track.locate([[moment.x, moment.y]]).arc[0] + 1.0)
    off = math.atan2(ahead.y - moment.y, ahead.x - moment.x) - moment.yaw
    return 4.0 * math.atan2(math.sin(off), math.cos(off))


def laps_of(drive, track, count):
    """Drive until so many laps are complete, calmly."""
    return laps_from(drive.restart(), drive, track, count)


def laps_from(moment, drive, track, count):
    """Drive on from a moment until so many laps are complete, calmly."""
    laps = []
    for _ in range(count * 300):
        moment, lap = drive.tick(steer(track, moment), 0.0)
        laps += [lap] if lap else []
        if len(laps) == count:
            return laps
    raise AssertionError(f"{len(laps)} laps, expected {count}")


@pytest.fixture(scope="module")
def driven():
    """A world and two laps in it, the second at speed over the line."""
    world = world_by_hand(None, TRACK)
    return world, laps_of(HandDrive(world), world.track, 2)


def test_a_lap_holds_what_the_person_saw_and_did(driven):
    world, (first, second) = driven
    assert (first.is_flying, second.is_flying) == (False, True)
    assert second.seconds == pytest.approx(len(second.path) / 15, abs=0.07)
    assert len(second.shown) == len(second.shown.observations["FRONT_FACING_CAMERA"]) > 100
    assert set(np.unique(second.shown.actions)) <= set(range(len(world.actions.speed)))
    assert {world.actions.speed[one] for one in second.shown.actions} == {1.5}  # no gas: the slowest of the table


def test_a_car_off_the_road_stands_on_the_line_again(driven):
    world, _ = driven
    drive = HandDrive(world)
    begin = drive.restart()
    for _ in range(60):
        moment, lap = drive.tick(1.0, 1.0)
        assert lap is None
        if moment.ended:
            break
    assert moment.ended == "off_track"
    assert (moment.x, moment.y) == pytest.approx((begin.x, begin.y), abs=1e-6)
    (lap,) = laps_from(moment, drive, world.track, 1)
    assert lap.seconds > 8.0, "the short drives of a training are none of a person's"


def test_laps_are_kept_come_back_and_are_dropped(driven, tmp_path):
    _, laps = driven
    file = tmp_path / "laps.safetensors"
    kept = DrivenLaps(file, TRACK)
    for lap in laps:
        kept.add(lap)
    again = DrivenLaps(file, TRACK)
    assert [lap.seconds for lap in again.laps] == [pytest.approx(lap.seconds, abs=1e-4) for lap in laps]
    assert again.best.path == pytest.approx(min(laps, key=lambda lap: lap.seconds).path, abs=1e-4)
    again.drop(0)
    assert read_demonstrations(file).num_episodes == 1
    assert (read_demonstrations(file).actions == laps[1].shown.actions).all()
    with pytest.raises(SettingError, match="there are 1 laps"):
        again.drop(1)
    again.drop(0)
    assert not file.exists()


def test_a_file_of_something_else_is_refused(tmp_path):
    (tmp_path / "laps.safetensors").write_bytes(b"no tensors")
    with pytest.raises(CheckpointError):
        DrivenLaps(tmp_path / "laps.safetensors", TRACK)
