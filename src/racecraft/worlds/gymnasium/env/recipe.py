"""How an environment is made beside its name: arguments of its making, and wrappers. Begin with `Recipe`."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import gymnasium

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.contract.loading import add_cwd_to_path, load_class
from racecraft.worlds.gymnasium.env.user_env import telling


@dataclass(frozen=True)
class Recipe:
    """How an environment is made; the default makes it as it is registered."""

    arguments: Mapping[str, Any] = field(default_factory=dict)
    """Given to `gymnasium.make`, or to the class."""
    wrappers: tuple[str, ...] = ()
    """Laid around it, the innermost first: names of `gymnasium.wrappers`, or "module:Class"."""

    def __bool__(self) -> bool:
        """Tell whether anything is otherwise than registered."""
        return bool(self.arguments or self.wrappers)

    def as_data(self) -> dict[str, Any]:
        """Return what job.json keeps of it; nothing of the default."""
        data = {"env_args": dict(self.arguments), "wrappers": list(self.wrappers)}
        return {name: value for name, value in data.items() if value}

    @classmethod
    def of_data(cls, data: Mapping[str, Any]) -> Recipe:
        """Return what `as_data` gave."""
        return cls(data.get("env_args") or {}, tuple(data.get("wrappers") or ()))

    @classmethod
    def of_options(cls, arguments: Sequence[str], wrappers: Sequence[str]) -> Recipe:
        """Return what was typed; a value that is JSON is read as such.

        Raises:
            SettingError: An argument without a name.

        >>> Recipe.of_options(["map_name=4x4", "is_slippery=false"], []).arguments
        {'map_name': '4x4', 'is_slippery': False}
        """
        pairs = {}
        for one in arguments:
            name, equals, value = one.partition("=")
            if not equals or not name.isidentifier():
                raise SettingError("--env-args is {found!r}; expected NAME=VALUE, such as size=4.", found=one)
            pairs[name] = _value(value)
        return cls(pairs, tuple(wrappers))

    def as_words(self) -> list[str]:
        """Return it as it is typed."""
        pairs = [("--env-args", text) for text in self.argument_texts()] + [("--wrapper", one) for one in self.wrappers]
        return [word for pair in pairs for word in pair]

    def argument_texts(self) -> tuple[str, ...]:
        """Return NAME=VALUE of each argument.

        >>> Recipe({"size": 4, "name": "4x4", "word": "4"}).argument_texts()
        ('size=4', 'name=4x4', 'word="4"')
        """
        return tuple(
            f"{name}={value if isinstance(value, str) and _value(value) == value else json.dumps(value)}"
            for name, value in self.arguments.items()
        )

    def make(self, environment: str, own: Any) -> gymnasium.Env[Any, Any]:
        """Make one environment.

        Args:
            environment: A registered id, or "module:Class".
            own: The class, where it is one.

        Raises:
            UserInputError: It takes no such argument, or there is no such wrapper.
        """
        try:
            if own is None:
                env = gymnasium.make(environment, disable_env_checker=True, **self.arguments)
            else:
                env = (telling(own) if isinstance(own, type) else own)(**self.arguments)
        except (TypeError, gymnasium.error.Error) as error:
            raise UserInputError(
                "{environment} cannot be made with {arguments}: {error}. Expected arguments that its making takes.",
                environment=environment,
                arguments=", ".join(f"{name}={value!r}" for name, value in self.arguments.items()) or "no arguments",
                error=error,
            ) from error
        for name, wrapper in zip(self.wrappers, self.load_wrappers(), strict=True):
            env = _wrapped(name, wrapper, env)
        return env

    def load_wrappers(self) -> list[type]:
        """Return the classes of the wrappers.

        Raises:
            SettingError: One is not there, or is no wrapper.
        """
        return [_wrapper(name) for name in self.wrappers]


def named(environment: Any) -> tuple[str, Recipe]:
    """Return the name of a class, of a function or of a ready environment's id, and how another like it is made.

    Raises:
        SettingError: Another like it cannot be made by a name.
    """
    if isinstance(environment, gymnasium.Env):
        return _as_it_was_made(environment)
    module, name = getattr(environment, "__module__", ""), getattr(environment, "__qualname__", "")
    if getattr(sys.modules.get(module), name, None) is not environment:
        raise SettingError(
            "environment is {found!r}, which has no name in a module; expected an id, or a module's class or function "
            "that makes an environment.", found=environment,
        )  # fmt: skip
    return f"{module}:{name}", Recipe()


def _as_it_was_made(environment: gymnasium.Env[Any, Any]) -> tuple[str, Recipe]:
    """Return what `gymnasium.make` and the wrappers behind it were given."""
    spec = environment.spec
    wrappers = () if spec is None else spec.additional_wrappers
    if spec is None or any(one.kwargs for one in wrappers):
        raise SettingError(
            "environment is {found}, and no second one can be made as it was; expected one of gymnasium.make with "
            "wrappers that take no arguments, or a function of a module that makes it.", found=environment,
        )  # fmt: skip
    return spec.id, Recipe(spec.kwargs, tuple(one.entry_point for one in wrappers))


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text


def _wrapper(name: str) -> type:
    if ":" in name:
        add_cwd_to_path()
        found: Any = load_class(name, "gym train --wrapper")
    else:
        found = getattr(gymnasium.wrappers, name, None)
    if not isinstance(found, type) or not issubclass(found, gymnasium.Wrapper):
        raise SettingError(
            "--wrapper {name}: found {found}; expected a name of gymnasium.wrappers, or MODULE:CLASS of a "
            "gymnasium.Wrapper.",
            name=name,
            found="nothing" if found is None else repr(found),
        )
    return found


def _wrapped(name: str, wrapper: type, env: gymnasium.Env[Any, Any]) -> gymnasium.Env[Any, Any]:
    try:
        wrapped: gymnasium.Env[Any, Any] = wrapper(env)
    except TypeError as error:
        raise SettingError(
            "--wrapper {name}: {error}; expected one that is made of an environment alone. Derive one in a file of "
            "your own that gives the rest.",
            name=name,
            error=error,
        ) from error
    return wrapped
