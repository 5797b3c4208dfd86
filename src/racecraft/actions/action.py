"""A verb: a function of a frozen request that returns a frozen result. Begin with `action`.

    @action
    def record(request: RecordRequest, progress: Progress = quiet) -> Recorded: ...

    record(RecordRequest(run="runs/CartPole-v1-1", episodes=3))
    record("runs/CartPole-v1-1", episodes=3)                        the same, by the fields' names

An action prints nothing and reads no command line; what it has to say goes to `progress`. The command line
(`cli.from_request`), `import racecraft as rc` and the JSON schema are made from it.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import make_request, options_as_typed

Result = TypeVar("Result")


class Served:
    """A result that lasts: a page, or an endpoint. Whoever called the action calls `serve`."""

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Listen, call `ready` as soon as the result can be shown, serve until Ctrl-C or SIGTERM, and close.

        Args:
            ready: Shows the result.
            progress: Receives messages.
        """
        raise NotImplementedError


class Action(Generic[Result]):
    """A verb that takes its request whole, or by the names of its fields."""

    __name__: str

    def __init__(self, function: Callable[..., Result]) -> None:
        functools.update_wrapper(self, function)
        self._function = function

    @functools.cached_property
    def request(self) -> type:
        """The class of its requests."""
        first = next(iter(inspect.signature(self._function).parameters.values()))
        return _named(self._function, first.annotation)[0]

    @functools.cached_property
    def results(self) -> tuple[type, ...]:
        """The classes of its results that its module knows by name; others are described by their JSON alone."""
        return tuple(_named(self._function, inspect.signature(self._function).return_annotation))

    def __call__(self, *arguments: Any, progress: Callable[[str], None] = quiet, **values: Any) -> Result:
        """Do it.

        Args:
            arguments: A request alone; or its arguments, in their order.
            progress: Receives messages; a `Progress` receives how much is done as well.
            values: Further fields of the request, those of its groups too.

        Raises:
            UserInputError: Something given cannot be used.
        """
        if len(arguments) == 1 and isinstance(arguments[0], self.request) and not values:
            request = arguments[0]
        else:
            request = make_request(self.request, *arguments, **values)
        with options_as_typed(request):
            return self._function(request, progress if isinstance(progress, Progress) else _Messages(progress))


def _named(function: Callable[..., Any], annotation: Any) -> list[type]:
    """Return the classes that an annotation names; one that is imported for type checks only is left out."""
    if isinstance(annotation, type):
        return [annotation]
    known = inspect.unwrap(function).__globals__
    return [known[name] for name in annotation.split(" | ") if name in known]


class _Messages(Progress):
    """Hands messages on to a function."""

    def __init__(self, receive: Callable[[str], None]) -> None:
        self._receive = receive

    def __call__(self, message: str) -> None:
        self._receive(message)


def action(function: Callable[..., Result]) -> Action[Result]:
    """Return a function of a request and a `Progress` as an action; its docstring is the command's help."""
    return Action(function)
