"""Commands made from requests: the same fields typed and named, the same result shown and as JSON."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
import typer

from racecraft.actions.action import action
from racecraft.cli.entry import print_errors
from racecraft.cli.from_request import command
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option


@dataclass(frozen=True, kw_only=True)
class Film(Request):
    PANEL = "Film and picture"

    fps: int = option(30, "Pictures a second.", low=15, unit="Hz")


@dataclass(frozen=True, kw_only=True)
class Drive(Request):
    run: str = argument("A run.", metavar="RUN[:which]")
    film: Film = group(Film)
    only: tuple[str, ...] = option((), "These alone.", "--only", "-o")
    pace: tuple[float, ...] = option((), "Of each car.", low=0, high=1)
    pictures: bool = option(True, "Leave pictures.")
    output: Path | None = option(None, "A file.")


@dataclass(frozen=True)
class Driven:
    request: Drive
    exit_code: int = 0


@action
def drive(request: Drive, progress: Progress = quiet) -> Driven:
    """Drive a lap.

    Raises:
        SettingError: The run is called wrong.
    """
    progress("driving")
    if request.run == "wrong":
        raise SettingError("wrong is no run.")
    return Driven(request, 3 if request.run == "three" else 0)


@pytest.fixture
def typed(monkeypatch, capsys):
    """Type the command; return the exit code, standard output, standard error and what was shown."""
    shown = []
    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    app.command()(command(drive, shown.append))

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["drive", *words])
        code = 0
        try:
            print_errors(app)
        except SystemExit as ended:
            code = ended.code or 0
        told = capsys.readouterr()
        return code, told.out, told.err, shown

    return call


def test_what_is_typed_and_what_python_names_make_the_same_request(typed):
    code, out, _, shown = typed(
        "r", "--fps", "60", "-o", "a", "--only", "b", "--no-pictures", "--output", "x", "--pace", "0.5", "--pace", "1"
    )
    assert (code, out) == (0, "driving\n")
    assert shown[0] == drive("r", fps=60, only=["a", "b"], pace=[0.5, 1], pictures=False, output="x")


def test_json_owns_standard_output(typed):
    code, out, err, shown = typed("three", "--json")
    assert (code, err, shown) == (3, "driving\n", [])
    assert json.loads(out)["request"]["film"] == {"fps": 30}


@pytest.mark.parametrize(
    ("words", "kind", "found"),
    [
        (["wrong"], "SettingError", None),
        (["r", "--fps", "3"], "SettingError", {"setting": "--fps", "found": 3, "low": 15, "unit": "Hz"}),
        (["r", "--pace", "0.5", "--pace", "1.5"], "SettingError", {"setting": "--pace", "found": 1.5, "high": 1}),
        (["r", "--fsp", "60"], "UsageError", {"found": "--fsp", "hint": "Did you mean '--fps'?"}),
        ([], "UsageError", {"command": "racecraft", "missing": "RUN[:which]"}),
        (["r", "--output"], "UsageError", {"option": "--output"}),
    ],
)
def test_an_error_under_json_is_one_object_and_exit_code_2(typed, words, kind, found):
    code, out, err, _ = typed("--json", *words)
    error = json.loads(out)["error"]
    assert (code, error["kind"]) == (2, kind)
    assert error["message"] in err
    assert found is None or found.items() <= error["fields"].items()


def test_help_ends_before_the_sections_for_programmers(typed):
    _, out, _, _ = typed("--help")
    assert "Drive a lap." in out
    assert "Raises" not in out
    assert "--pictures" in out
    assert "--no-pictures" in out
    assert "[15 or more Hz]" in out
