"""Every variable as it stands in a racer's folder: in which order, with which value, from where."""

import pytest

from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.files.env_table import read_env_rows
from racecraft.worlds.deepracer.files.run_env_variables import ENV_VARIABLES


@pytest.fixture
def rows(tmp_path):
    (tmp_path / "system.env").write_text("DR_LOCAL_SECRET_ACCESS_KEY=hush\n")
    (tmp_path / "run.env").write_text("DR_CAR_NAME=Mona\n\nDR_WORLD_NAM=Monaco\nDR_WHATEVER=1\n")
    (tmp_path / "worker-2.env").write_text("DR_CAR_NAME=Lisa\nDR_NOBODY=2\n")
    return read_env_rows(tmp_path)


def test_every_variable_has_a_row_what_is_obeyed_before_what_is_not(rows):
    known = rows[: len(ENV_VARIABLES)]
    assert sorted(row.name for row in known) == sorted(variable.name for variable in ENV_VARIABLES)
    statuses = [row.status for row in known]
    assert list(dict.fromkeys(statuses)) == ["used", "verbs", "told", "without"]
    assert statuses == sorted(statuses, key=["used", "verbs", "told", "without"].index)


def test_a_value_stands_with_its_default_and_its_line(rows):
    found = {row.name: row for row in rows[: len(ENV_VARIABLES)]}
    name = found["DR_CAR_NAME"]
    assert (name.value, name.default, name.location) == ("Mona", "FastCar", "run.env:1")
    world = found["DR_WORLD_NAME"]
    assert (world.value, world.default, world.location) == (None, "reinvent_base", "")
    assert found["DR_DISPLAY_NAME"].default == "Mona", "a default is made of other words"
    secret = found["DR_LOCAL_SECRET_ACCESS_KEY"]
    assert (secret.value, secret.location) == ("(not shown)", "system.env:1")
    assert found["DR_LOCAL_ACCESS_KEY_ID"].value is None


def test_unknown_names_and_those_of_workers_stand_behind(rows):
    behind = rows[len(ENV_VARIABLES) :]
    assert [(row.name, row.value, row.location, row.status) for row in behind] == [
        ("DR_WORLD_NAM", "Monaco", "run.env:3", "unknown"),
        ("DR_WHATEVER", "1", "run.env:4", "unknown"),
        ("DR_CAR_NAME", "Lisa", "worker-2.env:1", "told"),
        ("DR_NOBODY", "2", "worker-2.env:2", "unknown"),
    ]
    assert behind[0].effect == "Nobody knows this name; it does nothing. Did you mean 'DR_WORLD_NAME'?"
    assert behind[2].default == "Mona", "what counts where the worker says nothing is the installation's word"


def test_a_folder_that_is_no_racers_is_refused(tmp_path):
    with pytest.raises(UserInputError, match=r"holds no run\.env"):
        read_env_rows(tmp_path)
