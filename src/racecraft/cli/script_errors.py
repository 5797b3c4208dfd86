"""How a user's own script tells its errors: as Python would, without the lines of ours that led to it."""

from __future__ import annotations

import contextlib
import runpy
import traceback
from collections.abc import Iterator
from pathlib import Path

import typer

import racecraft
from racecraft.contract.errors import RacecraftError

OURS = (str(Path(racecraft.__file__).parent), runpy.__file__, "<frozen ")
"""How names of files begin that are none of the user's."""


@contextlib.contextmanager
def format_script_error() -> Iterator[None]:
    """Print an error from the script's own first line on, and leave with code 1; letters of ours go through.

    Raises:
        Exit: There was one.
    """
    try:
        yield
    except (RacecraftError, BrokenPipeError):
        raise
    except Exception as error:
        trace = error.__traceback__
        while trace is not None and trace.tb_frame.f_code.co_filename.startswith(OURS):
            trace = trace.tb_next
        of_us = trace is None and not isinstance(error, SyntaxError)
        traceback.print_exception(type(error), error, error.__traceback__ if of_us else trace)
        raise typer.Exit(1) from None
