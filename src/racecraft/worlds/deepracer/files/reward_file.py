"""`reward_function.py`: what a car is paid for. The user's own file, run unchanged.

`load_reward_function` runs it in this process, with all rights of the user; a training and `racecraft check` ask
`env/reward_process.py`, which does so in a process that has none, and keeps the clock.

A `RewardFunction`'s `call` turns one dictionary of parameters into one number or into a `RewardError`: file, line,
exception, and the parameters of that moment. `copies` gives each car one of its own, with globals, class state and
modules beside the file of its own, as each worker had at AWS.

The file is compiled under its real name, so tracebacks and debuggers find its lines. `print` is replaced in the
module's own names, which costs nothing per call, so prints can go to the run's log.

    reward_source.py     what the file says, before it is run
    reward_analysis.py   what its text tells

What is taken for a number is what AWS took: whatever `float()` makes one of (facts: simapp `rollout_agent_ctrl.py`).
"""

from __future__ import annotations

import builtins
import inspect
import itertools
import math
import sys
import traceback
import types
import warnings
from collections.abc import Callable, Mapping
from dis import opname
from pathlib import Path
from typing import Any, NoReturn, Protocol, TextIO

from racecraft.contract.errors import RewardError, RewardFileError, nearest
from racecraft.contract.loading import UserModules
from racecraft.contract.message import Message
from racecraft.worlds.deepracer.files.reward_examples import (
    Params,
    default_reward_source,
    example_situations,
    racing_reward_source,
)
from racecraft.worlds.deepracer.files.reward_source import KIND, RewardSource, how_to_install, read_reward_source

__all__ = [
    "MAX_REWARD",
    "RewardFunction",
    "default_reward_source",
    "racing_reward_source",
    "example_situations",
    "load_reward_function",
    "validate",
]

MAX_REWARD = 1e5
"""Largest size of a reward; AWS ends the training beyond it."""
DENIED = (
    "A reward function may compute, print and read files beside it; `racecraft train --trust-reward` gives it all your "
    "rights."
)
"""What to know of an exception that restrictions may have raised."""

_numbers = itertools.count()


class Pays(Protocol):
    """A reward function, in this process or in one of its own."""

    def call(self, params: Params, /) -> float:
        """Return the reward for one dictionary of parameters."""
        ...


class RewardFunction:
    """A user's reward function, ready to be called.

    Attributes:
        source: What the file says, and the modules beside it; as they were when it was loaded.
        output: Where its prints go, and those of copies made of it; None is standard output.
        is_restricted: Whether this process can do nothing but compute (`racecraft/isolation`).
    """

    def __init__(self, source: RewardSource, modules: UserModules, family: RewardFunction | None = None) -> None:
        self.source = source
        self.output: TextIO | None = None
        self.is_restricted: bool = family is not None and family.is_restricted
        self._modules, self._family = modules, family
        self._function: Callable[[Params], Any] = _nothing

    @property
    def path(self) -> Path:
        """The file it came from."""
        return self.source.path

    def copies(self, count: int) -> list[RewardFunction]:
        """Return one for each car: with state of its own where the file may keep any, else this one, shared.

        Raises:
            RewardFileError: The file, which could be loaded once, cannot be loaded again.
        """
        if self.source.analysis.state is None:
            return [self] * count
        return [self._copy() for _ in range(count)]

    def call(self, params: Params) -> float:
        """Return the reward for one tick.

        Args:
            params: The parameters of AWS, in the units of AWS; the user's function may change the dictionary.

        Raises:
            RewardError: The function raised, or returned something that is no finite number within ±1e5.
        """
        try:
            value = self._function(params)
        except BaseException as error:
            if _is_interrupt(error):
                raise
            self._report(error, params)
        if type(value) is float and -MAX_REWARD <= value <= MAX_REWARD:
            return value
        return self._as_reward(value, params)

    def print(self, *values: object, sep: str | None = " ", end: str | None = "\n", **options: Any) -> None:
        """Stand in for `print` inside the user's module."""
        if options.get("file") is None:
            options["file"] = self.output if self._family is None else self._family.output
        builtins.print(*values, sep=sep, end=end, **options)

    def _copy(self) -> RewardFunction:
        copy = RewardFunction(self.source, self._modules, self._family or self)
        copy._load(lambda *values, **options: None)  # what it prints while it is loaded has been said once
        return copy

    def _load(self, print_line: Callable[..., None]) -> None:
        """Run the user's module and find its function; `print_line` prints meanwhile."""
        printing = [print_line]
        name = f"racecraft_reward_{next(_numbers)}"
        try:
            module = self._modules.load(name, lambda *values, **options: printing[0](*values, **options))
            vars(module)["print"] = self.print
            printing[0] = self.print
            self._function = _find_function(self.source, module)
        except BaseException as error:
            sys.modules.pop(name, None)
            if isinstance(error, RewardFileError) or _is_interrupt(error):
                raise
            self._refuse_import(error)

    def _refuse_import(self, error: BaseException) -> NoReturn:
        inside = _lines_in(error, self.path)
        hint = self._denied(error)
        if isinstance(error, ModuleNotFoundError):
            hint = how_to_install(error.name or "", self.path)
        raise RewardFileError(
            self.path,
            Message("{what_was_raised} while it was imported", what_was_raised=_what_was_raised(error)),
            "a module that can be imported",
            hint,
            line=inside[-1] if inside else None,
        ) from error

    def _as_reward(self, value: Any, params: Params) -> float:
        found = f"returned {_short(value)}"
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # NumPy's of arrays of one number, which float() takes
                number = float(value.item() if getattr(value, "size", 0) == 1 and hasattr(value, "item") else value)
            found = f"returned {number:g}"
        except BaseException as error:
            if _is_interrupt(error):
                raise
            if _lines_in(error, self.path) or not isinstance(error, TypeError | ValueError | OverflowError):
                self._report(error, params)  # what was returned has methods of the file's own
            number = math.nan
            too_large = isinstance(error, OverflowError)
            found += ", too large for a number" if too_large else f", of type {type(value).__name__}"
        if -MAX_REWARD <= number <= MAX_REWARD:
            return number
        raise RewardError(
            "{path}:{first_line}: reward_function {found}; expected a number from -1e5 to 1e5. "
            "Make every path through the function return such a number.\n{pretty}",
            path=self.path,
            first_line=self.first_line,
            found=found,
            pretty=_pretty(params),
        )

    def _report(self, error: BaseException, params: Params) -> NoReturn:
        inside = _lines_in(error, self.path)
        line = inside[-1] if inside else self.first_line
        lines = self.source.text.splitlines()
        text = lines[line - 1].strip() if 0 < line <= len(lines) else ""
        hint = self._denied(error) or "Mend this line, or guard it against these parameters."
        if isinstance(error, KeyError) and error.args and isinstance(error.args[0], str) and params:
            hint = f"{nearest(error.args[0], params)} {hint}"
        elif isinstance(error, ModuleNotFoundError):
            hint = how_to_install(error.name or "", self.path)
        raise RewardError(
            "{path}:{line}: reward_function {what_was_raised}{elsewhere}; expected a "
            "number. {hint}\n    {text}\n{pretty}",
            path=self.path,
            line=line,
            what_was_raised=_what_was_raised(error),
            elsewhere=_elsewhere(error, self.path),
            hint=hint,
            text=text,
            pretty=_pretty(params),
        ) from error

    def _denied(self, error: BaseException) -> str:
        """Return what to know of an exception that restrictions may have raised; "" of any other."""
        is_likely = isinstance(error, PermissionError | MemoryError | BlockingIOError) or "new thread" in _text_of(
            error, str
        )
        return DENIED if self.is_restricted and is_likely else ""

    @property
    def first_line(self) -> int:
        """The line at which the function begins; 1 where it is compiled."""
        code = getattr(inspect.unwrap(self._function), "__code__", None)
        return code.co_firstlineno if code is not None else 1


def load_reward_function(
    path: str | Path | RewardSource, output: TextIO | None = None, is_restricted: bool = False
) -> RewardFunction:
    """Load a user's reward function: `def reward_function(params)`, or `reward = Reward()` with such a method.

    Running it runs the user's code with the rights of this process; load only what its owner asked to run.

    Args:
        path: The user's file, or what was read of it.
        output: Where its prints go; None is standard output. May be changed later.
        is_restricted: Whether this process can do nothing but compute.

    Raises:
        RewardFileError: The file is missing or empty, does not compile, fails while it is imported, or holds no reward
            function of one parameter.
    """
    source = path if isinstance(path, RewardSource) else read_reward_source(path)
    reward = RewardFunction(source, UserModules(source.path, source.code, source.modules))
    reward.output, reward.is_restricted = output, is_restricted
    reward._load(reward.print)
    return reward


def validate(reward: Pays) -> dict[str, float]:
    """Try a reward function on a few made-up situations and return what it paid, by the situation's name.

    The module's global state changes by it, as by any call.

    Raises:
        RewardError: It failed in one of them.
    """
    return {name: reward.call(params) for name, params in example_situations().items()}


def _nothing(params: Params) -> float:
    return 0.0


def _find_function(source: RewardSource, module: types.ModuleType) -> Callable[[Params], Any]:
    function = getattr(module, "reward_function", None)
    if function is None:
        function = getattr(getattr(module, "reward", None), "reward_function", None)
    if function is None:
        raise RewardFileError(
            source.path, "there is no function `reward_function`", KIND, _how_to_name(module), key="reward_function"
        )
    if not callable(function):
        raise RewardFileError(
            source.path, Message("`reward_function` is {short}", short=_short(function)), KIND, key="reward_function"
        )
    try:
        inspect.signature(function).bind({})
    except TypeError:
        line = getattr(getattr(function, "__code__", None), "co_firstlineno", None)
        found = Message(
            "`reward_function{signature}` cannot be called with one parameter", signature=inspect.signature(function)
        )
        raise RewardFileError(
            source.path, found, "`def reward_function(params):`", line=line, key="reward_function"
        ) from None
    except ValueError:
        pass  # a compiled function hides its parameters; the first call will tell
    return function


def _how_to_name(module: types.ModuleType) -> str:
    names = [name for name, value in vars(module).items() if callable(value) and not name.startswith("_")]
    names = [name for name in names if getattr(vars(module)[name], "__module__", None) == module.__name__]
    if hasattr(getattr(module, "Reward", None), "reward_function"):
        return "Add the line `reward = Reward()` at the end."
    return f"{nearest('reward_function', names)} Rename it." if names else ""


def _what_was_raised(error: BaseException) -> str:
    text = _text_of(error, str)
    return f"raised {type(error).__name__}{': ' * bool(text)}{text}"


def _text_of(value: Any, print_line: Callable[[Any], str]) -> str:
    """Return what an object of the file's own says of itself, in which its code may fail."""
    try:
        return print_line(value)
    except BaseException as error:
        if _is_interrupt(error):
            raise
        return f"a value that cannot be shown ({type(error).__name__})"


def _is_interrupt(error: BaseException) -> bool:
    """Tell a person's Ctrl-C from all that the code raised."""
    return isinstance(error, KeyboardInterrupt) and not _raised_by_its_author(error)


def _raised_by_its_author(error: BaseException) -> bool:
    """Tell a `raise` that stands in the code from a person's Ctrl-C."""
    place = error.__traceback__
    while place is not None and place.tb_next is not None:
        place = place.tb_next
    return place is not None and opname[place.tb_frame.f_code.co_code[place.tb_lasti]] == "RAISE_VARARGS"


def _lines_in(error: BaseException, path: Path) -> list[int]:
    """Return the lines of a file that an exception came through, outermost first."""
    frames = traceback.extract_tb(error.__traceback__)
    return [frame.lineno for frame in frames if frame.filename == str(path) and frame.lineno]


def _elsewhere(error: BaseException, path: Path) -> str:
    deeper = traceback.extract_tb(error.__traceback__)[-1]
    return "" if deeper.filename == str(path) else f" (raised in {deeper.filename}:{deeper.lineno})"


def _pretty(params: Mapping[str, Any]) -> str:
    """Return the parameters as lines a person can read; long lists are shortened."""
    if not isinstance(params, Mapping):
        return f"  parameters: {_short(params)}"
    rows = [f"    {key} = {_short(value)}" for key, value in params.items()]
    return "  The parameters of that moment:\n" + "\n".join(rows)


def _short(value: Any) -> str:
    """Return a value's text, long lists and long texts shortened.

    >>> _short([(0.0, 1.0)] * 119)
    '[(0.0, 1.0), (0.0, 1.0), ... 119 in all]'
    """
    if isinstance(value, list | tuple) and len(value) > 6:
        return f"[{_text_of(value[0], repr)}, {_text_of(value[1], repr)}, ... {len(value)} in all]"
    text = _text_of(value, repr)
    return text if len(text) <= 200 else f"{text[:200]}..."
