"""Streams of local trainings: their times, and the dates by which a notebook asks for them."""

import os
from datetime import datetime

import pytest

from racecraft.worlds.deepracer.logs import local_streams
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.local_streams import SIMULATIONS, iso_to_timestamp, streams

from . import makers


@pytest.mark.parametrize("text", ["May 19, 2019", "2019-05-19", "19 May 2019 00:00"])
def test_a_date_is_read_as_people_write_it(text):
    assert iso_to_timestamp(text) == int(1000 * datetime(2019, 5, 19).timestamp())


def test_what_is_no_date_is_refused_by_name():
    with pytest.raises(LogError, match="19 May 2019"):
        iso_to_timestamp("yesterday")


def test_the_times_of_a_stream_are_those_of_its_files_not_of_its_folder(tmp_path, monkeypatch):
    """Two runs whose folders were copied the other way round: the newest is the one that was driven last."""
    monkeypatch.setenv(local_streams.ROOT, str(tmp_path))
    for name, written in (("later", 2_000_000), ("earlier", 1_000_000)):
        run = makers.drfc(tmp_path / name, iterations=2)
        for k in range(2):
            os.utime(run / "training-simtrace" / f"{k}-iteration.csv", (written + 600 * k,) * 2)
    os.utime(tmp_path / "earlier", (9_000_000, 9_000_000))
    first, last = streams(SIMULATIONS)
    assert [stream.path.name for stream in (first, last)] == ["earlier", "later"]
    assert last.last_ms == 2_000_600_000
    assert 1_999_900_000 < last.first_ms < 2_000_000_000, "its simulated seconds before its first file was written"
