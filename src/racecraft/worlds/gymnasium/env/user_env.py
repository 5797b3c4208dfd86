"""Asks a user's environment; what goes wrong in it becomes an error with its file and line. Begin with `call_env`."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable
from typing import Any

from racecraft.contract.errors import EnvironmentFailedError, RacecraftError
from racecraft.contract.user_code_location import display_path, user_code_location

WRAPPERS = ("gymnasium.", "racecraft.", "gym.")
"""Modules whose classes lay something round an environment: their names begin so."""
METHODS = ("reset", "step", "begin_episodes", "park", "pop_episodes", "save_state", "load_state", "close")
"""What is asked of a world."""


def call_env(env: Any, method: str, *words: Any, **named: Any) -> Any:
    """Call a method of an environment and return what it gives.

    Raises:
        EnvironmentFailedError: It raised.
    """
    return _guarded(env, method, getattr(env, method), words, named)


def call_reset(env: Any, seed: int) -> Any:
    """Begin an episode of a Gymnasium environment; return observation and info.

    Raises:
        EnvironmentFailedError: It raised, or gave other things.
    """
    result = call_env(env, "reset", seed=seed)
    return _all_of(env, "reset", result, ("observation", "info"))


def step_env(env: Any, action: Any) -> Any:
    """Step a Gymnasium environment; return observation, reward, terminated, truncated and info.

    Raises:
        EnvironmentFailedError: It raised, or gave other things.
    """
    result = call_env(env, "step", action)
    return _all_of(env, "step", result, ("observation", "reward", "terminated", "truncated", "info"))


def _all_of(env: Any, method: str, result: Any, things: tuple[str, ...]) -> Any:
    if isinstance(result, tuple) and len(result) == len(things):
        return result
    gave = f"{len(result)} things" if isinstance(result, tuple) else type(result).__name__
    raise EnvironmentFailedError(
        "{place}{name}.{method} gave {gave}; expected ({things}). Mend what it returns.",
        place=_place(env, method),
        name=_name(env),
        method=method,
        gave=gave,
        things=", ".join(things),
    )


def made(make: Callable[..., Any], *words: Any, **named: Any) -> Any:
    """Make an environment.

    Raises:
        EnvironmentFailedError: Its making raised.
    """
    try:
        return make(*words, **named)
    except RacecraftError:
        raise
    except (Exception, SystemExit) as error:
        what = make.__name__ if isinstance(make, type) else "the environment"
        raise EnvironmentFailedError(
            "{line}{what} {said} as it was made; expected one that can be "
            "made again and again, for several stand side by side. Mend it there.",
            line=_line(user_code_location(error)),
            what=what,
            said=_said(error),
        ) from error


def reward_given(env: Any, reward: Any) -> float:
    """Return what an environment gave as a reward.

    Raises:
        EnvironmentFailedError: It is no number, or none that can be learned from.
    """
    try:
        value = float(reward)
    except (TypeError, ValueError) as error:
        raise contract_error(env, "step", "reward", reward, "a number", error) from error
    if not math.isfinite(value):
        raise contract_error(env, "step", "reward", reward, "a number", "nothing is learned from it")
    return value


def failure(env: Any, method: str, error: BaseException) -> EnvironmentFailedError:
    """Return the error about an environment whose method failed."""
    place = _line(user_code_location(error)) or _place(env, method)
    return EnvironmentFailedError(
        "{place}{name}.{method} {said}; expected an environment that plays episode after episode. Mend it there.",
        place=place,
        name=_name(env),
        method=method,
        said=_said(error),
    )


def contract_error(env: Any, method: str, what: str, value: Any, space: Any, why: object) -> EnvironmentFailedError:
    """Return the error about something that an environment gave and that does not fit what it promised."""
    shape = getattr(value, "shape", None)
    gave = f"{type(value).__name__} of shape {tuple(shape)}" if shape is not None else _short(value)
    return EnvironmentFailedError(
        "{place}{name}.{method} gave {gave} as {what} ({why}); expected {space}. Mend "
        "what it returns, or what it promises.",
        place=_place(env, method),
        name=_name(env),
        method=method,
        gave=gave,
        what=what,
        why=why,
        space=space,
    )


def missing_error(env: Any, name: str) -> EnvironmentFailedError:
    """Return the error about something that an environment has not."""
    return EnvironmentFailedError(
        "{place}{name} has no {name_2}; expected one of gym's spaces, set as it is made.",
        place=_place(env, "__init__"),
        name=_name(env),
        name_2=name,
    )


def telling(own: type) -> type:
    """Return a user's class of worlds with what its methods raise told as letters, and all else of it its own."""

    def asking(method: str) -> Callable[..., Any]:
        function = getattr(own, method)

        @functools.wraps(function)
        def ask(self: Any, *words: Any, **named: Any) -> Any:
            return _guarded(self, method, functools.partial(function, self), words, named)

        return ask

    methods = {name: asking(name) for name in METHODS if inspect.isfunction(getattr(own, name, None))}
    return type(own.__name__, (own,), {"__module__": own.__module__, "__doc__": own.__doc__, **methods})


def _guarded(env: Any, method: str, call: Callable[..., Any], words: tuple[Any, ...], named: dict[str, Any]) -> Any:
    try:
        return call(*words, **named)
    except RacecraftError:
        raise
    except (Exception, SystemExit) as error:
        raise failure(env, method, error) from error


def _bare(env: Any) -> Any:
    """Return what the user wrote, without what others laid round it."""
    while type(env).__module__.startswith(WRAPPERS) and hasattr(env, "env"):
        env = env.env
    return env


def _name(env: Any) -> str:
    return type(_bare(env)).__name__


def _place(env: Any, method: str) -> str:
    """Return where a method of an environment begins, as far as Python knows."""
    function = inspect.unwrap(getattr(type(_bare(env)), method, lambda: None))
    try:
        file, (_, line) = inspect.getsourcefile(function), inspect.getsourcelines(function)
    except (OSError, TypeError):
        return ""
    return f"{display_path(file)}:{line}: " if file else ""


def _line(place: str) -> str:
    return f"{place}: " if place else ""


def _said(error: BaseException) -> str:
    text = str(error)
    return f"raised {type(error).__name__}{': ' * bool(text)}{text}"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:80]}..."
