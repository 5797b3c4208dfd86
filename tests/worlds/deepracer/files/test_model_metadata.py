"""`model_metadata.json`: real files, odd files, wrong files."""

import dataclasses
import json
import math

import pytest
from tests.reference import DATA

from racecraft.contract.errors import MetadataError
from racecraft.worlds.deepracer.files.model_metadata import (
    ActionRanges,
    CarAction,
    ModelMetadata,
    action_space_from_aws,
    as_aws_dict,
    car_for_version,
    default_model_metadata,
    read_model_metadata,
    write_model_metadata,
)

CAR = {
    "action_space": [{"steering_angle": -30, "speed": 1.0}, {"steering_angle": 30, "speed": 1.0}],
    "sensor": ["FRONT_FACING_CAMERA"],
    "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "version": "5",
}


def car_file(tmp_path, **changes):
    """Write a small car with some keys changed; a change to None takes the key out."""
    car = {key: value for key, value in {**CAR, **changes}.items() if value is not None}
    path = tmp_path / "model_metadata.json"
    path.write_text(json.dumps(car, indent=1), encoding="utf-8")
    return path


def real_files():
    return sorted(DATA.glob("models/**/*.json")) + sorted(DATA.glob("traces/**/model_metadata.json"))


def test_every_real_file_reads_and_comes_back_the_same(tmp_path):
    read = 0
    for path in real_files():
        if "hyperparameters" in path.name:
            continue
        metadata = read_model_metadata(path)
        write_model_metadata(metadata, tmp_path / "copy.json")
        again = read_model_metadata(tmp_path / "copy.json")
        assert again == dataclasses.replace(metadata, version=metadata.version or "5"), path
        read += 1
    assert read >= 20


def test_a_real_file_says_what_it_says():
    metadata = read_model_metadata(DATA / "traces/console-2022/model/model_metadata.json")
    assert len(metadata.actions) == 14
    assert metadata.actions[2] == CarAction(math.radians(-20), 1.0)
    continuous = read_model_metadata(DATA / "models/drfc-defaults/model_metadata_sac.json")
    assert continuous.action_space == ActionRanges(math.radians(-30), math.radians(30), 1.0, 2.0)
    assert (continuous.training_algorithm, continuous.car) == ("sac", "v4")


def test_the_default_car_is_the_consoles_whose_actions_go_from_right_to_left_slow_before_fast():
    metadata = default_model_metadata()
    actions = [(round(math.degrees(one.steering_rad)), one.speed_mps) for one in metadata.actions]
    assert actions == [(angle, speed) for angle in (-30, -15, 0, 15, 30) for speed in (0.5, 1.0)]
    assert [one.label for one in metadata.actions[3:7]] == [
        "right 15°, 1 m/s", "straight, 0.5 m/s", "straight, 1 m/s", "left 15°, 0.5 m/s"
    ]  # fmt: skip
    assert metadata.sensors == ("FRONT_FACING_CAMERA",)
    assert metadata.car == "v6", "its actions are the console's, and it drives as cars do today"


def test_minus_thirty_degrees_is_to_the_right_and_is_written_as_minus_thirty(tmp_path):
    write_model_metadata(default_model_metadata(), tmp_path / "car.json")
    first = json.loads((tmp_path / "car.json").read_text())["action_space"][0]
    assert first == {"steering_angle": -30.0, "speed": 0.5, "index": 0}
    assert default_model_metadata().actions[0].steering_rad == pytest.approx(-math.pi / 6)


def test_the_version_chooses_the_car_and_one_between_two_counts_as_the_lower():
    cars = {"1": "v4", "4.9": "v4", "5": "v5-classic", "6": "v6", None: "v6"}
    assert {version: car_for_version(version) for version in cars} == cars


def test_odd_spellings_are_read(tmp_path):
    path = car_file(
        tmp_path,
        action_space=[
            {"steering_angle": "-30", "speed": "1", "index": "x"},
            {"steering_angle": " 15.0 ", "speed": 5, "index": 0},
        ],
        sensor="front_facing_camera",
        version=4.0,
        training_algorithm="PPO",
        lidar_config={"num_sectors": "8"},
        my_remark={"kept": [1]},
    )
    text = "// my car\n" + path.read_text()
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    metadata = read_model_metadata(path)
    assert metadata.actions == (CarAction(math.radians(-30), 1.0), CarAction(math.radians(15), 5.0))
    assert (metadata.version, metadata.car) == ("4", "v4")
    assert metadata.unknown == {"my_remark": {"kept": [1]}}
    told = " | ".join(metadata.notes)
    for word in (
        "comments",
        "1 of 2 actions (left 15°, 5 m/s) reach beyond",
        "index",
        "list with that word",
        "lidar_config",
        "'my_remark'",
    ):
        assert word in told, word


def test_a_car_without_sensor_and_version_is_the_oldest_kind(tmp_path):
    metadata = read_model_metadata(car_file(tmp_path, sensor=None, version=None, neural_network=None))
    assert metadata.sensors == ("observation",)
    assert metadata.neural_network == "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"


CONTINUOUS = {"steering_angle": {"low": -30, "high": 30}, "speed": {"low": 1, "high": 2}}


def test_what_aws_took_is_taken_and_said_once(tmp_path):
    """AWS checked no range: these trained there, clipped to ±30 degrees and 0.1 to 4 m/s at sending."""
    written = [(-45.0, 0.0), (45.0, 12.0), (30.0, 4.0), (-30.0, 0.1), (0.0, -1.0)]
    path = car_file(tmp_path, action_space=[{"steering_angle": a, "speed": v} for a, v in written])
    metadata = read_model_metadata(path)
    assert [(round(math.degrees(a.steering_rad), 9), a.speed_mps) for a in metadata.actions] == written
    (told,) = metadata.notes
    assert told == (
        "3 of 5 actions (right 45°, 0 m/s; left 45°, 12 m/s; straight, -1 m/s) reach beyond what is sent to a car and "
        "are clipped there to ±30° and 0.1 to 4 m/s: the reward function and the traces see them so, with "
        "--fidelity aws as written"
    )
    assert not read_model_metadata(car_file(tmp_path)).notes


@pytest.mark.parametrize(("count", "noted"), [(30, False), (31, True)])
def test_more_actions_than_a_console_takes_are_taken_and_said(tmp_path, count, noted):
    space = [{"steering_angle": float(number - 15), "speed": 1.0} for number in range(count)]
    metadata = read_model_metadata(car_file(tmp_path, action_space=space))
    assert len(metadata.actions) == count
    assert any("AWS consoles take at most 30" in note for note in metadata.notes) == noted


@pytest.mark.parametrize(
    ("angles", "speeds", "noted"),
    [((-30, 30), (0.1, 4), False), ((-31, 30), (1, 2), True), ((-20, 20), (1, 4.1), True)],
)
def test_a_continuous_car_is_read_and_written_as_aws_has_it(tmp_path, angles, speeds, noted):
    space = {"steering_angle": {"low": angles[0], "high": angles[1]}, "speed": {"low": speeds[0], "high": speeds[1]}}
    metadata = read_model_metadata(car_file(tmp_path, action_space=space, action_space_type="continuous"))
    low, high = math.radians(angles[0]), math.radians(angles[1])
    assert metadata.action_space == ActionRanges(low, high, *map(float, speeds))
    said = f"actions from {angles[0]} to {angles[1]}° and {speeds[0]} to {speeds[1]} m/s reach beyond"
    assert [note.startswith(said) for note in metadata.notes] == [True] * noted
    write_model_metadata(metadata, tmp_path / "again.json")
    written = json.loads((tmp_path / "again.json").read_text())
    assert written["action_space"] == space
    assert written["action_space_type"] == "continuous"
    assert action_space_from_aws(written["action_space"]) == metadata.action_space


def action(**changes):
    return [CAR["action_space"][0], {**CAR["action_space"][1], **changes}]


WRONG = [  # changes, what the letter must hold: line (None where there can be none), key, found, expected
    ({"action_space": None}, None, "action_space", "missing", "list of actions"),
    ({"action_space": []}, 2, "action_space", "0 action", "2 actions or more"),
    (
        {"action_space": [{"speed": 1}, {"steering_angle": 0, "speed": 1}]},
        3,
        "action_space[0]",
        "no 'steering_angle'",
        "degrees",
    ),
    ({"action_space": action(speed="fast")}, 9, "action_space[1].speed", "'fast'", "a number, in m/s"),
    ({"action_space": action(speed=float("nan"))}, 9, "action_space[1].speed", "nan", "a number, in m/s"),
    (
        {"action_space": {**CONTINUOUS, "speed": {"low": 2, "high": 1}}},
        7,
        "action_space.speed",
        "low is 2 and high is 1",
        "below high",
    ),
    ({"action_space": {"speed": {"low": 1, "high": 2}}}, 2, "action_space.steering_angle", "no 'steering", '"low"'),
    *(
        ({"action_space": {**CONTINUOUS, "speed": ends}}, 7, "action_space.speed", "", "")
        for ends in ({"low": 1}, {"low": 1, "high": 1}, 3)
    ),
    ({"sensor": ["FRONT_FACING_CAM"]}, 12, "sensor", "FRONT_FACING_CAM", "Did you mean 'FRONT_FACING_CAMERA'"),
    ({"sensor": ["LIDAR"]}, 12, "sensor", "0 camera", "exactly one camera"),
    ({"sensor": ["FRONT_FACING_CAMERA", "LIDAR", "SECTOR_LIDAR"]}, 12, "sensor", "2 LiDAR", "at most one LiDAR"),
    ({"neural_network": "BIG"}, 15, "neural_network", "BIG", "DEEP_CONVOLUTIONAL_NETWORK_DEEP"),
    *(({"version": wrong}, 16, "version", "", '"1" to "6"') for wrong in (0.9, "new", "7")),
    ({"training_algorithm": "dqn"}, 17, "training_algorithm", "dqn", "clipped_ppo or sac"),
    ({"training_algorithm": "sac"}, 17, "training_algorithm", "list of actions", "continuous"),
    ({"action_space_type": "continuous"}, 17, "action_space_type", "a list of actions", "discrete"),
    ({"lidar_config": {"num_sectors": 7}}, 18, "lidar_config.num_sectors", "7", "divisor of its 64 beams"),
    ({"lidar_config": [8, 8]}, 17, "lidar_config", "a list", "an object"),
]


@pytest.mark.parametrize(("changes", "line", "key", "found", "expected"), WRONG)
def test_a_wrong_car_gets_a_letter_with_line_and_key(tmp_path, changes, line, key, found, expected):
    path = car_file(tmp_path, **changes)
    with pytest.raises(MetadataError) as caught:
        read_model_metadata(path)
    letter = str(caught.value)
    place = str(path) + (f":{line}" if line else "") + f": {key}: "
    assert letter.startswith(place)
    assert found in letter.removeprefix(place)
    assert expected in letter.removeprefix(place)


BROKEN = [  # text, line, found
    ('{\n "a": 1,\n}\n', 2, "comma stands after the last"),  # the comma's own line, on every Python
    ("{\n 'a': 1}", 2, "quoted with '"),
    ('{\n "a": \u201c1\u201d}', 2, "typographic quote"),
    ("", None, "empty"),
    ("[]", 1, "a list"),
]


@pytest.mark.parametrize(("text", "line", "found"), BROKEN)
def test_broken_json_gets_a_letter_with_the_line(tmp_path, text, line, found):
    path = tmp_path / "model_metadata.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MetadataError) as caught:
        read_model_metadata(path)
    assert str(caught.value).startswith(str(path) + (f":{line}: " if line else ": "))
    assert found in str(caught.value)
    assert "expected a JSON object" in str(caught.value)


def test_a_missing_file_a_folder_and_no_text_are_told_apart(tmp_path):
    (tmp_path / "bytes.json").write_bytes(b'{\n"a": "\xff\xfe\xfa"}')
    for name, found in [("nothing.json", "no such file"), (".", "a folder"), ("bytes.json", "not UTF-8")]:
        with pytest.raises(MetadataError, match=found):
            read_model_metadata(tmp_path / name)


@pytest.mark.parametrize(("version", "read"), [("6.9", "6.9"), ("", None), (4.0, "4")])
def test_versions_from_one_to_below_seven_are_read(tmp_path, version, read):
    metadata = read_model_metadata(car_file(tmp_path, version=version))
    assert (metadata.version, metadata.notes) == (read, ())


def test_a_car_that_leaves_out_what_has_a_default_is_told_what_is_taken(tmp_path):
    metadata = read_model_metadata(car_file(tmp_path, sensor=None, neural_network=None))
    assert metadata.sensors == ("FRONT_FACING_CAMERA",), "older files, without a version, say observation"
    assert metadata.training_algorithm == "clipped_ppo"
    assert metadata.notes == (
        "there is no sensor; 'FRONT_FACING_CAMERA', the front camera, is taken",
        "there is no neural_network; DEEP_CONVOLUTIONAL_NETWORK_SHALLOW is taken",
    )


def numbered(*indices):
    return [{"steering_angle": number, "speed": 1.0, "index": index} for number, index in enumerate(indices)]


@pytest.mark.parametrize(
    ("space", "said"),
    [
        (numbered(0, 1, 2), ""),
        (numbered(1, 0), "the written index differs from the order of the list; the order counts, as at AWS"),
        ([CAR["action_space"][0]] * 2, "the same action stands in the list more than once"),
    ],
)
def test_what_is_odd_about_a_list_of_actions_is_said(tmp_path, space, said):
    assert read_model_metadata(car_file(tmp_path, action_space=space)).notes == ((said,) if said else ())


def test_a_car_is_written_for_people_with_every_key(tmp_path):
    car = dataclasses.replace(default_model_metadata(), version=None, lidar_config={"num_sectors": 8}, unknown={"a": 1})
    write_model_metadata(car, tmp_path / "car.json")
    told = json.loads((tmp_path / "car.json").read_text())
    assert list(told) == ["action_space", "sensor", "neural_network", "training_algorithm", "action_space_type",
                          "version", "lidar_config", "a"]  # fmt: skip
    assert told["version"] == "5"


def test_straight_on_is_written_without_a_sign():
    car = ModelMetadata((CarAction(-0.0, 1.0), CarAction(math.radians(-1e-12), 2.0)))
    assert [str(action["steering_angle"]) for action in as_aws_dict(car)["action_space"]] == ["0.0", "0.0"]
