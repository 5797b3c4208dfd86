"""Unity's form in the console: what is typed becomes the command, and programs are the owner's alone."""

import pytest

from racecraft.console.parts import parts_of
from racecraft.contract.errors import SettingError
from racecraft.contract.loading import refuses_own_code


def test_what_is_typed_becomes_the_command():
    typed = {"build": " scenes/Walker.x86_64 ", "config": "walker.yaml", "algorithm": "sac", "from": "runs/a:best"}
    assert parts_of("unity").words(typed) == [
        "unity", "train", "scenes/Walker.x86_64", "--config=walker.yaml", "--algorithm=sac", "--stop=minutes=5",
        "--seed=1", "--from=runs/a:best",
    ]  # fmt: skip


@pytest.mark.parametrize("build", ["", "--run=x", "scenes/Walker.x86_64", "registry:Walker", "editor"])
def test_who_was_invited_runs_no_program(build):
    token = refuses_own_code.set(True)
    try:
        assert parts_of("unity").words({})[2] == "builtin:Basic"
        with pytest.raises(SettingError, match="builtin:Basic"):
            parts_of("unity").words({"build": build})
    finally:
        refuses_own_code.reset(token)
