"""The way into the command line, and all that is done before a command is imported. Begin with `main`.

The process of a training may import before it knows its words, a command that is named comes without the others
(`table.py`), and the dr- command that trains says so first of all.
"""

from __future__ import annotations

import contextlib
import functools
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NoReturn

from racecraft.contract.errors import RacecraftError, UserInputError
from racecraft.training.signals import (
    StoppedError,
    end_at_once_on_interrupt,
    forgotten_interrupts_return,
    interrupts_stop,
)


def main() -> None:
    """Run the command line."""
    if "RACECRAFT_LIFELINE" in os.environ:  # a job's process; everybody else is spared the imports
        _become_a_job()
    words = sys.argv[1:]
    with forgotten_interrupts_return(), _head_start(words):
        try:
            print_errors(functools.partial(_imported, words))
        finally:
            end_at_once_on_interrupt()


def _imported(words: list[str], **options: Any) -> object:
    """Import the command that the words name, and run it."""
    from racecraft.cli.table import app_for

    return app_for(words)(**options)


def print_errors(command: Callable[..., object]) -> None:
    """Run a command; an error of ours is printed and becomes an exit code, under --json as one JSON object as well."""
    try:
        with interrupts_stop():
            code = command(standalone_mode=False)
    except RacecraftError as error:
        _end_with(error)
    except StoppedError as stopped:
        end_at_once_on_interrupt()
        print(f"racecraft: {stopped}", file=sys.stderr)
        sys.exit(stopped.exit_code)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(141)
    except Exception as error:
        _end_for_typer(error)
        raise
    if isinstance(code, int):
        sys.exit(code)


def _end_with(error: RacecraftError) -> NoReturn:
    """Print an error, under --json on standard output too: {"error": {"kind": …, "message": …, "template": …, …}}."""
    print("\n".join([f"racecraft: {error}", *getattr(error, "__notes__", ())]), file=sys.stderr)
    if "--json" in sys.argv:
        from racecraft.cli.output import print_json

        print_json({"error": error.as_data()})
    sys.exit(2 if isinstance(error, UserInputError) else 1)


def _end_for_typer(error: Exception) -> None:
    """End where Typer found no command line, printed its help or was answered no; else do nothing."""
    kind = type(error).__name__
    if kind == "NoArgsIsHelpError":
        if help := str(error):  # Typer with Rich has printed it
            print(help, file=sys.stderr)
        sys.exit(2)
    if kind == "Abort":
        print("racecraft: stopped.", file=sys.stderr)
        sys.exit(1)
    if hasattr(error, "format_message"):
        from racecraft.cli.usage import usage_error

        _end_with(usage_error(error))


def _become_a_job() -> None:
    from racecraft.jobs import parent_watch

    if "RACECRAFT_SPARE" in os.environ:
        from racecraft.contract.kinds import kinds
        from racecraft.jobs.preload import await_words

        await_words(
            [module for kind in kinds() for module in kind.imported_ahead],
            (kind.piece("warm_up") for kind in kinds() if kind.warm_up),
        )
    parent_watch.exit_with_parent()


@contextlib.contextmanager
def _head_start(words: Sequence[str]) -> Iterator[None]:
    """Have the interpreter of a training begin to import before this command reads what is to be trained."""
    with contextlib.ExitStack() as until_then:
        if _puts_a_training_into_the_queue(words):
            from racecraft.jobs.job_paths import JobPaths
            from racecraft.jobs.preload import announce_job

            with contextlib.suppress(OSError, RacecraftError):  # which the command will tell in its own words
                until_then.enter_context(announce_job(JobPaths.of_user()))
        yield


def _puts_a_training_into_the_queue(words: Sequence[str]) -> bool:
    if not words or {"--help", "-h"} & set(words):
        return False
    from racecraft.cli.commands import command_named

    command = command_named(words[0])
    return command is not None and not {*command.queues}.isdisjoint(words[1:])
