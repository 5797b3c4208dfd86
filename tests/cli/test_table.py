"""A command that is named comes without the others, and says the same by itself as among all."""

import subprocess
import sys

import pytest
from typer.testing import CliRunner

from racecraft.cli.app import app
from racecraft.cli.commands import commands
from racecraft.cli.table import app_for


@pytest.mark.parametrize("command", commands(), ids=lambda one: one.name)
def test_a_command_by_itself_helps_as_it_does_among_all(command):
    words = [command.name, "--help"]
    alone, among_all = (CliRunner().invoke(one, words, prog_name="racecraft") for one in (app_for(words), app))
    assert alone.exit_code == among_all.exit_code == 0
    assert alone.output == among_all.output
    assert f"racecraft {command.name}" in alone.output


@pytest.mark.parametrize("words", [[], ["--help"], ["trian"], ["--version"]], ids=str)
def test_words_that_name_no_command_have_all_of_them(words):
    alone, among_all = (CliRunner().invoke(one, words, prog_name="racecraft") for one in (app_for(words), app))
    assert (alone.exit_code, alone.output) == (among_all.exit_code, among_all.output)


def test_a_command_is_imported_alone():
    code = "import sys; from racecraft.cli.table import app_for; app_for(['logs']); print(*sys.modules)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "racecraft.worlds.deepracer.cli.logs" in found
    assert "racecraft.worlds.deepracer.cli.train" not in found


def test_a_command_of_no_world_looks_for_no_world():
    code = "import sys; from racecraft.cli.table import app_for; app_for(['stop']); print(*sys.modules)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "racecraft.cli.runs.stop" in found
    assert not any(name.startswith("racecraft.worlds") for name in found)
