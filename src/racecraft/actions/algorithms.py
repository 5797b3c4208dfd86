"""List what can learn, and which actions it can decide."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request


@dataclass(frozen=True, kw_only=True)
class AlgorithmsRequest(Request):
    """Nothing: all are listed."""


@dataclass(frozen=True)
class AlgorithmRow:
    """An algorithm."""

    name: str
    title: str
    acts: list[str]
    """Kinds of action that it decides."""
    settings: str
    """Its group of settings."""

    @property
    def action_kinds_text(self) -> str:
        """What it decides, for people."""
        from racecraft.algorithms.registry import action_kinds_text

        return action_kinds_text(self.acts)


@dataclass(frozen=True)
class AlgorithmList:
    """Every algorithm."""

    algorithms: list[AlgorithmRow]


@action
def algorithms(request: AlgorithmsRequest, progress: Progress = quiet) -> AlgorithmList:
    """List every algorithm that `--algorithm` takes: the built-in ones and those of installed packages.

    Example: racecraft algorithms
    """
    from racecraft.algorithms.registry import all_algorithms

    return AlgorithmList([AlgorithmRow(one.name, one.title, list(one.acts), one.group) for one in all_algorithms()])
