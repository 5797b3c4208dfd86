"""The table of a policy on several tracks: it comes back as it was written, and damage is named."""

import pytest

from racecraft.contract.errors import RunFolderError
from racecraft.worlds.deepracer.files.generalisation import TrackResult, read_generalisation, write_generalisation

ROWS = (
    TrackResult("Oval_track, mine", "Oval_track", "trained", "TIME_TRIAL", False, 5, 5, 100.0, 12.25),
    TrackResult("LGSWide reversed boxes", "LGSWide", "held_out", "OBJECT_AVOIDANCE", True, 5, 0, 31.207, None),
)


def test_a_table_comes_back_as_it_was_written(tmp_path):
    path = tmp_path / "generalisation.csv"
    assert read_generalisation(path) is None
    write_generalisation(path, 30, ROWS)
    assert read_generalisation(path) == (30, ROWS)
    assert path.read_text().splitlines() == [
        "iteration,label,track,role,race,reverse,laps,full_laps,mean_progress_percent,best_lap_seconds",
        '30,"Oval_track, mine",Oval_track,trained,TIME_TRIAL,false,5,5,100.0,12.25',
        "30,LGSWide reversed boxes,LGSWide,held_out,OBJECT_AVOIDANCE,true,5,0,31.207,",
    ]


@pytest.mark.parametrize("damage", [("trained", "seen"), (",5,5,", ",5,x,"), (",100.0,12.25", "")])
def test_a_damaged_table_is_named(tmp_path, damage):
    path = tmp_path / "generalisation.csv"
    write_generalisation(path, 1, ROWS)
    path.write_text(path.read_text().replace(*damage, 1))
    with pytest.raises(RunFolderError, match=r"generalisation\.csv: cannot be read"):
        read_generalisation(path)
