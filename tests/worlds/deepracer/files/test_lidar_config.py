"""What a LiDAR's config may say, and what is told of it."""

import json

import pytest

from racecraft.contract.errors import MetadataError
from racecraft.formats.json_text import read_json
from racecraft.worlds.deepracer.files.lidar_config import lidar_notes, read_lidar_config

SECTORS = "DISCRETIZED_SECTOR_LIDAR"
DEFAULTS = "num_sectors 8, num_values_per_sector 8, clipping_dist 2"
"""What AWS's simulator takes where the file is silent."""


def config_of(tmp_path, config):
    path = tmp_path / "model_metadata.json"
    path.write_text(json.dumps({"lidar_config": config}))
    return read_lidar_config(read_json(path, MetadataError, "a car"))


@pytest.mark.parametrize(
    "config", [{"num_sectors": 64}, {"clipping_dist": 0.15}, {"clipping_dist": 12}, {}, {"mine": 3}]
)
def test_a_figure_at_its_border_is_taken(tmp_path, config):
    assert config_of(tmp_path, config) == config


def test_numbers_may_be_text_and_the_key_may_be_absent_or_empty(tmp_path):
    assert config_of(tmp_path, {"num_sectors": "16", "clipping_dist": "1.5"}) == {
        "num_sectors": 16,
        "clipping_dist": 1.5,
    }
    assert config_of(tmp_path, None) is None


BEYOND = [
    ("num_sectors", 0, "a divisor of its 64 beams: 1, 2, 4, 8, 16, 32, 64"),
    ("num_sectors", 12, "a divisor of its 64 beams"),
    ("num_values_per_sector", 2.5, "a whole number from 1 to 1000"),
    ("clipping_dist", 12.001, "0.15 to 12 m"),
    ("mine", "far", "a number"),
]


@pytest.mark.parametrize(("key", "value", "expected"), BEYOND)
def test_a_figure_beyond_its_border_is_refused(tmp_path, key, value, expected):
    with pytest.raises(MetadataError) as caught:
        config_of(tmp_path, {key: value})
    assert (caught.value.key, caught.value.line) == (f"lidar_config.{key}", 1)
    assert str(caught.value.expected).startswith(expected)


TOLD = [
    (["FRONT_FACING_CAMERA"], None, []),
    (["FRONT_FACING_CAMERA", SECTORS], None, [f"there is no lidar_config; {DEFAULTS} is taken"]),
    (["LIDAR"], {}, ["lidar_config is kept and does nothing: LIDAR has its own figures"]),
    (
        ["FRONT_FACING_CAMERA"],
        {"num_sectors": 8},
        ["lidar_config is kept and does nothing: there is no LiDAR among the sensors"],
    ),
    ([SECTORS], {"num_sectors": 8, "num_values_per_sector": 4, "clipping_dist": 1.0}, []),
    (
        [SECTORS],
        {"num_sectors": 8, "clipping": 1.0},
        [
            "unknown key 'clipping' in lidar_config is kept and does nothing. Did you mean 'clipping_dist'?",
            "lidar_config leaves out num_values_per_sector 8, clipping_dist 2, which is taken",
        ],
    ),
]


@pytest.mark.parametrize(("sensors", "config", "told"), TOLD)
def test_what_does_nothing_and_what_is_taken_instead_is_told(sensors, config, told):
    assert lidar_notes(sensors, config) == told
