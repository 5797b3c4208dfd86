"""Options in groups: typed one by one, taken together."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import pytest
import typer
from typer.testing import CliRunner

from racecraft.cli.option_groups import flags, option_names, takes_groups


@dataclass(frozen=True)
class Film:
    PANEL: ClassVar[str] = "Film and picture"

    fps: Annotated[int, typer.Option(min=15, help="Pictures a second.")] = 30
    save_mp4: Annotated[bool, typer.Option("--save-mp4")] = False
    only: Annotated[list[str] | None, typer.Option()] = None


@dataclass(frozen=True)
class LongFilm(Film):
    fps: Annotated[int, typer.Option(min=15, help="Its own words.")] = 60
    last: Annotated[int | None, typer.Option()] = None


@pytest.fixture
def typed():
    """Type a command; return its exit code, what it printed, and what it was called with."""
    called = []
    app = typer.Typer(rich_markup_mode=None)

    @app.command()
    @takes_groups
    def film(
        context: typer.Context, run: Annotated[str, typer.Argument()] = "here", *, film: LongFilm, json: bool = False
    ) -> None:
        called.append((getattr(context, "params", {}), run, film, json))

    def call(*words):
        told = CliRunner().invoke(app, words)
        return told.exit_code, told.output, called[-1] if called else None

    call.command = film
    call.called = called
    return call


def test_a_group_is_typed_option_by_option(typed):
    code, _, (params, run, film, json) = typed("there", "--fps", "20", "--save-mp4", "--last", "3", "--json")
    assert (code, run, film, json) == (0, "there", LongFilm(20, True, None, 3), True)
    assert params["fps"] == 20  # --resume and --detach ask the context, option by option
    assert "film" not in params


def test_what_is_not_typed_has_its_default(typed):
    assert typed()[2][1:] == ("here", LongFilm(), False)
    assert typed()[2][2].fps == 60


def test_limits_and_panels_come_with_the_fields(typed):
    code, told, _ = typed("--fps", "3")
    assert code == 2
    assert "--fps" in told
    [panel] = {one.rich_help_panel for one in typer.main.get_command(_app(typed)).params if one.name == "fps"}
    assert panel == "Film and picture"


def test_from_python_fields_are_keywords(typed):
    typed.command("context", run="there", save_mp4=True)
    assert typed.called[-1][1:] == ("there", LongFilm(save_mp4=True), False)


def test_a_word_that_is_no_option_is_refused_from_python_too(typed):
    with pytest.raises(TypeError, match="fpss"):
        typed.command("context", fpss=3)


def test_what_was_given_is_told_by_option():
    assert flags(LongFilm(fps=60, only=["glare"])) == {
        "--fps": None, "--save-mp4": None, "--only": ["glare"], "--last": None,
    }  # fmt: skip
    assert option_names(LongFilm) == ("fps", "save_mp4", "only", "last")


def _app(typed):
    app = typer.Typer()
    app.command()(typed.command)
    return app
