"""Every variable as it stands in one racer's folder: value, where it was written, what it does. See `env_rows`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.errors import UserInputError, nearest
from racecraft.worlds.deepracer.files.drfc_folder import default_text
from racecraft.worlds.deepracer.files.run_env import EnvFolder, RunEnv, read_env_folder
from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME, ENV_VARIABLES, VARIABLE_EFFECTS


@dataclass(frozen=True)
class EnvRow:
    """One variable in one folder."""

    name: str
    value: str | None
    """As it was given, variables filled in; None where it was not."""
    default: str
    """What counts where it was not given."""
    status: str
    """A key of STATUSES; "unknown" where nobody knows the name."""
    effect: str
    """What it does here, or why it does nothing."""
    location: str = ""
    """File and line; empty where it was not given."""


def read_env_rows(folder: Path) -> list[EnvRow]:
    """Return every variable as it stands in a racer's folder, those of worker files behind the others.

    Raises:
        UserInputError: There is no folder, or no run.env in it.
        RunEnvError: A file in it cannot be used.
    """
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "there is no such folder"
        raise UserInputError("{folder}: {what}; expected a racer's folder with a run.env.", folder=folder, what=what)
    if not (folder / "run.env").is_file():
        raise UserInputError(
            "{folder}: holds no run.env; expected the settings of DeepRacer for Cloud. `racecraft init` makes one; "
            "`racecraft settings` without a folder lists racecraft's own.",
            folder=folder,
        )
    return list(env_rows(read_env_folder(folder)))


def env_rows(whole: EnvFolder) -> Iterator[EnvRow]:
    """Yield every variable: those that are obeyed first, those that do nothing last, then unknown ones."""
    for status in VARIABLE_EFFECTS:
        for variable in ENV_VARIABLES:
            if variable.status == status:
                default = default_text(variable.name, whole.run)
                value = _shown(variable.name, whole.run)
                yield EnvRow(variable.name, value, default, status, variable.effect, _place(whole.run, variable.name))
    yield from _unknown(whole.run)
    for worker in whole.workers.values():
        for name in worker.values:
            known = BY_NAME.get(name)
            if known is not None:
                default = whole.run.text(name, default_text(name, whole.run))
                yield EnvRow(name, _shown(name, worker), default, known.status, known.effect, _place(worker, name))
        yield from _unknown(worker)


def _unknown(env: RunEnv) -> Iterator[EnvRow]:
    for name, value in env.values.items():
        if name not in BY_NAME:
            hint = nearest(name, BY_NAME)
            near = f" {hint}" if hint.startswith("Did you mean") else ""
            text = f"Nobody knows this name; it does nothing.{near}"
            yield EnvRow(name, value, "", "unknown", text, _place(env, name))


def _shown(name: str, env: RunEnv) -> str | None:
    return "(not shown)" if name in env.values and BY_NAME[name].is_secret else env.values.get(name)


def _place(env: RunEnv, name: str) -> str:
    if name not in env.locations:
        return ""
    path, line = env.locations[name]
    return f"{path.name}:{line}"
