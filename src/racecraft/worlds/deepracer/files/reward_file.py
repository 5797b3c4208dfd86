"""`reward_function.py`: what a car is paid for. The user's own file, run unchanged.

Begin with `load_reward_function`; it gives a `RewardFunction`, whose `call` turns one dictionary of parameters into one
number or into a letter to the author: file, line, exception, and the parameters of that moment. `copies` gives each car
one of its own, with globals, class state and modules beside the file of its own, as each worker had at AWS.

The file is compiled under its real name, so tracebacks and debuggers find its lines. `print` is replaced in the
module's own names, which costs nothing per call, so prints can go to the run's log.

    reward_source.py     what the file says, before it is run
    reward_analysis.py   what its text tells
    time_limit.py        how a call that hangs is ended

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
from typing import Any, NoReturn, TextIO

from racecraft.contract.errors import RewardError, RewardFileError, nearest
from racecraft.contract.loading import UserModules
from racecraft.worlds.deepracer.files.reward_examples import Params, default_reward_source, example_situations
from racecraft.worlds.deepracer.files.reward_source import KIND, RewardSource, how_to_install, read_reward_source
from racecraft.worlds.deepracer.files.time_limit import CallTooLongError, TimeLimit

__all__ = [
    "MAX_REWARD",
    "RewardFunction",
    "default_reward_source",
    "example_situations",
    "load_reward_function",
    "validate",
]

MAX_REWARD = 1e5
"""Largest size of a reward; AWS ends the training beyond it."""
CALL_SECONDS = 5.0
"""How long a call may last where nothing else is said; AWS's validator had the same limit."""
IMPORT_SECONDS = 120.0
"""How long loading may last: a first import of a large package takes its time."""

_numbers = itertools.count()


class RewardFunction:
    """A user's reward function, ready to be called.

    Attributes:
        source: What the file says, and the modules beside it; as they were when it was loaded.
        output: Where its prints go, and those of copies made of it; None is standard output.
    """

    def __init__(
        self, source: RewardSource, modules: UserModules, limit: TimeLimit, family: RewardFunction | None = None
    ) -> None:
        self.source = source
        self.output: TextIO | None = None
        self._modules, self._limit, self._family = modules, limit, family
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
            RewardError: The function raised, hung, or returned something that is no finite number within ±1e5.
        """
        try:
            value = self._limit.call(self._function, params)
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt) and not _raised_by_its_author(error):
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
        copy = RewardFunction(self.source, self._modules, self._limit, self._family or self)
        copy._load(lambda *values, **options: None)  # what it prints while it is loaded has been said once
        return copy

    def _load(self, say: Callable[..., None]) -> None:
        """Run the user's module and find its function; `say` prints meanwhile."""
        printing = [say]
        name = f"racecraft_reward_{next(_numbers)}"
        try:
            module = self._limit.call(
                lambda name: self._modules.load(name, lambda *values, **options: printing[0](*values, **options)),
                name,
                IMPORT_SECONDS,
            )
            vars(module)["print"] = self.print
            printing[0] = self.print
            self._function = _find_function(self.source, module)
        except BaseException as error:
            sys.modules.pop(name, None)
            if isinstance(error, RewardFileError) or (
                isinstance(error, KeyboardInterrupt) and not _raised_by_its_author(error)
            ):
                raise
            self._refuse_import(error)

    def _refuse_import(self, error: BaseException) -> NoReturn:
        raised, found = _what_was_raised(error, IMPORT_SECONDS)
        inside = _lines_in(raised, self.path)
        cure = ""
        if isinstance(raised, ModuleNotFoundError):
            cure = how_to_install(raised.name or "", self.path)
        raise RewardFileError(
            self.path, f"{found} while it was imported", "a module that can be imported", cure,
            line=inside[-1] if inside else None,
        ) from raised  # fmt: skip

    def _as_reward(self, value: Any, params: Params) -> float:
        found = f"returned {_short(value)}, of type {type(value).__name__}"
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # NumPy's of arrays of one number, which float() takes
                number = float(value.item() if getattr(value, "size", 0) == 1 and hasattr(value, "item") else value)
            found = f"returned {number:g}"
        except (TypeError, ValueError):
            number = math.nan
        except OverflowError:
            number, found = math.inf, f"returned {_short(value)}, too large for a number"
        if -MAX_REWARD <= number <= MAX_REWARD:
            return number
        raise RewardError(
            f"{self.path}:{self._first_line()}: reward_function {found}; expected a number from -1e5 to 1e5. "
            f"Make every path through the function return such a number.\n{_pretty(params)}"
        )

    def _report(self, error: BaseException, params: Params) -> NoReturn:
        raised, found = _what_was_raised(error, self._limit.seconds)
        inside = _lines_in(raised, self.path)
        line = inside[-1] if inside else self._first_line()
        lines = self.source.text.splitlines()
        text = lines[line - 1].strip() if 0 < line <= len(lines) else ""
        cure = "Mend this line, or guard it against these parameters."
        if isinstance(error, CallTooLongError):
            cure = "Mend the loop that it was in, or allow a call more time with --set race.reward_seconds=60."
        elif isinstance(raised, KeyError) and raised.args and isinstance(raised.args[0], str) and params:
            cure = f"{nearest(raised.args[0], params)} {cure}"
        elif isinstance(raised, ModuleNotFoundError):
            cure = how_to_install(raised.name or "", self.path)
        elsewhere = "" if isinstance(error, CallTooLongError) else _elsewhere(raised, self.path)
        raise RewardError(
            f"{self.path}:{line}: reward_function {found}{elsewhere}; expected a number. {cure}\n    {text}\n"
            f"{_pretty(params)}"
        ) from raised

    def _tell_stuck(self, thread: int) -> None:
        """Say that a call sits where nothing can end it; called from the time limit's own thread."""
        frame = sys._current_frames().get(thread)
        while frame is not None and frame.f_code.co_filename != str(self.path):
            frame = frame.f_back
        place = f"{self.path}" + (f":{frame.f_lineno}" if frame is not None else "")
        builtins.print(f"{place}: does not return and cannot be ended here; Ctrl-C ends the training.", file=sys.stderr)

    def _first_line(self) -> int:
        code = getattr(inspect.unwrap(self._function), "__code__", None)
        return code.co_firstlineno if code is not None else 1


def load_reward_function(
    path: str | Path | RewardSource, output: TextIO | None = None, seconds: float = CALL_SECONDS
) -> RewardFunction:
    """Load a user's reward function: `def reward_function(params)`, or `reward = Reward()` with such a method.

    Running it runs the user's code with the rights of this process; load only what its owner asked to run.

    Args:
        path: The user's file, or what was read of it.
        output: Where its prints go; None is standard output. May be changed later.
        seconds: How long a call may last, s.

    Raises:
        RewardFileError: The file is missing or empty, does not compile, would end the process, fails while it is
            imported, or holds no reward function of one parameter.
    """
    source = path if isinstance(path, RewardSource) else read_reward_source(path)
    modules = UserModules(source.path, source.code, source.modules)
    limit = TimeLimit(seconds)
    reward = RewardFunction(source, modules, limit)
    limit.stuck = reward._tell_stuck
    reward.output = output
    reward._load(reward.print)
    return reward


def validate(reward: RewardFunction) -> dict[str, float]:
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
        raise RewardFileError(source.path, f"`reward_function` is {_short(function)}", KIND, key="reward_function")
    try:
        inspect.signature(function).bind({})
    except TypeError:
        line = getattr(getattr(function, "__code__", None), "co_firstlineno", None)
        found = f"`reward_function{inspect.signature(function)}` cannot be called with one parameter"
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


def _what_was_raised(error: BaseException, seconds: float) -> tuple[BaseException, str]:
    """Return the user's own exception, and what happened as a clause."""
    if isinstance(error, CallTooLongError):
        late = "" if error.__cause__ else " (an `except` in it caught what was to end it)"
        return error.__cause__ or error, f"had not returned after {seconds:g} s{late}"
    said = str(error)
    return error, f"raised {type(error).__name__}{': ' * bool(said)}{said}"


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
        return f"[{value[0]!r}, {value[1]!r}, ... {len(value)} in all]"
    try:
        text = repr(value)
    except Exception as error:
        return f"a value that cannot be shown ({error})"
    return text if len(text) <= 200 else f"{text[:200]}..."
