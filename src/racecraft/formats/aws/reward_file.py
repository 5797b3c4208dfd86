"""`reward_function.py`: what a car is paid for. The user's own file, run unchanged.

Begin with `load_reward_function`; it gives a `RewardFunction`, whose `call` turns one dictionary of parameters into one
number or into a letter to the author: file, line, exception, and the parameters of that moment.

The file is compiled under its real name, so tracebacks and debuggers find its lines. Its folder is importable, so
helper modules may stand beside it. Its module lives as long as the function, so global state lasts over episodes.
`print` is replaced in the module's own names, which costs nothing per call, so prints can go to the run's log.

Source of the checks on what is returned: facts: simapp `rollout_agent_ctrl.py`.
"""

from __future__ import annotations

import builtins
import importlib
import inspect
import itertools
import math
import sys
import tokenize
import traceback
import types
import warnings
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, NoReturn, TextIO

from racecraft.contract.errors import RewardError, RewardFileError, nearest

MAX_REWARD = 1e5
"""Largest size of a reward; AWS ends the training beyond it."""

Params = dict[str, Any]
_KIND = "a Python file with `def reward_function(params):` that returns a number"
_numbers = itertools.count()
_siblings: set[str] = set()


class RewardFunction:
    """A user's reward function, ready to be called.

    Attributes:
        path: The file it came from.
        source: The file's text, as it was when it was loaded.
        output: Where its prints go; None is standard output.
    """

    def __init__(self, path: Path, source: str, function: Callable[[Params], Any], output: TextIO | None) -> None:
        self.path, self.source, self.output = path, source, output
        self._function = function

    def call(self, params: Params) -> float:
        """Return the reward for one tick.

        Args:
            params: The parameters of AWS, in the units of AWS; the user's function may change the dictionary.

        Raises:
            RewardError: The function raised, or returned something that is no finite number within ±1e5.
        """
        try:
            value = self._function(params)
        except (Exception, SystemExit) as error:
            self._report(error, params)
        if type(value) is float and -MAX_REWARD <= value <= MAX_REWARD:
            return value
        return self._as_reward(value, params)

    def print(self, *values: object, sep: str | None = " ", end: str | None = "\n", **options: Any) -> None:
        """Stand in for `print` inside the user's module."""
        if options.get("file") is None:
            options["file"] = self.output
        builtins.print(*values, sep=sep, end=end, **options)

    def _as_reward(self, value: Any, params: Params) -> float:
        number = None
        if hasattr(type(value), "__float__") and not getattr(value, "shape", ()):
            number = float(value)
        if number is None:
            found = f"returned {_short(value)}, of type {type(value).__name__}"
        elif not math.isfinite(number):
            found = f"returned {number}"
        elif abs(number) > MAX_REWARD:
            found = f"returned {number:g}"
        else:
            return number
        line = self._last_line()
        raise RewardError(
            f"{self.path}:{line}: reward_function {found}; expected a number from -1e5 to 1e5. "
            f"Make every path through the function return such a number.\n{_pretty(params)}"
        )

    def _report(self, error: BaseException, params: Params) -> NoReturn:
        frames = traceback.extract_tb(error.__traceback__)
        inside = [frame for frame in frames if frame.filename == str(self.path)]
        line = inside[-1].lineno if inside else self._last_line()
        lines = self.source.splitlines()
        text = lines[line - 1].strip() if line and line <= len(lines) else ""
        deeper = frames[-1]
        elsewhere = "" if deeper.filename == str(self.path) else f" (raised in {deeper.filename}:{deeper.lineno})"
        found = f"reward_function raised {type(error).__name__}: {error}{elsewhere}"
        cure = "Mend this line, or guard it against these parameters."
        if isinstance(error, KeyError) and error.args and isinstance(error.args[0], str) and params:
            cure = f"{nearest(error.args[0], params)} {cure}"
        raise RewardError(
            f"{self.path}:{line}: {found}; expected a number. {cure}\n    {text}\n{_pretty(params)}"
        ) from error

    def _last_line(self) -> int:
        code = getattr(inspect.unwrap(self._function), "__code__", None)
        return code.co_firstlineno if code is not None else 1


def load_reward_function(path: str | Path, output: TextIO | None = None) -> RewardFunction:
    """Load a user's reward function: `def reward_function(params)`, or `reward = Reward()` with such a method.

    Running it runs the user's code with the rights of this process; load only what its owner asked to run.

    Args:
        path: The user's file.
        output: Where its prints go; None is standard output. May be changed later.

    Raises:
        RewardFileError: The file is missing or empty, does not compile, fails while it is imported, or holds no
            reward function of one parameter.
    """
    path = Path(path)
    source = _read_source(path)
    code = _compiled(path, source)
    reward = RewardFunction(path, source, lambda params: 0.0, output)
    module = types.ModuleType(f"racecraft_reward_{next(_numbers)}")
    module.__file__ = str(path)
    vars(module)["print"] = reward.print
    sys.modules[module.__name__] = module
    try:
        _run(path, code, module, reward)
        reward._function = _find_function(path, source, module)
    except BaseException:
        del sys.modules[module.__name__]
        raise
    return reward


def default_reward_source() -> str:
    """Return our own reward function, as text for a new file: the nearer to the centre line, the more."""
    return _DEFAULT_SOURCE


def validate(reward: RewardFunction) -> dict[str, float]:
    """Try a reward function on a few made-up situations and return what it paid, by the situation's name.

    The module's global state changes by it, as by any call.

    Raises:
        RewardError: It failed in one of them.
    """
    return {name: reward.call(params) for name, params in example_situations().items()}


def example_situations() -> dict[str, Params]:
    """Return the parameters of a car on a round track, 8 m across, in some moments of a lap."""
    return {
        "at the start": _situation(),
        "on the way": _situation(progress=35.0, steps=80.0, speed=2.0, steering_angle=-15.0),
        "near the border": _situation(offset=0.45, progress=50.0, steps=120.0, all_wheels_on_track=False),
        "off the track": _situation(offset=0.7, progress=60.0, all_wheels_on_track=False, is_offtrack=True),
        "an object ahead": _situation(
            progress=70.0,
            closest_objects=[0, 0],
            objects_location=[[0.0, 4.0]],
            objects_left_of_center=[True],
            objects_distance=[6.3],
            objects_distance_from_center=[0.2],
            objects_heading=[0.0],
            objects_speed=[0.0],
            object_in_camera=True,
        ),
        "lap complete": _situation(progress=100.0, steps=250.0),
    }


def _read_source(path: Path) -> str:
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise RewardFileError(
            path, "there is no such file", _KIND, "`racecraft new` writes one to begin with."
        ) from None
    except OSError as error:
        raise RewardFileError(path, f"the file cannot be read ({error.strerror})", _KIND) from error
    if not data.strip():
        raise RewardFileError(path, "the file is empty", _KIND, "`racecraft new` writes one to begin with.")
    try:
        encoding, _ = tokenize.detect_encoding(BytesIO(data).readline)
        return data.decode(encoding)
    except (SyntaxError, UnicodeDecodeError, LookupError) as error:
        raise RewardFileError(path, f"no text that Python reads ({error})", "a text file in UTF-8") from None


def _compiled(path: Path, source: str) -> types.CodeType:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SyntaxWarning)
            warnings.simplefilter("ignore", DeprecationWarning)
            return compile(source.removeprefix("\ufeff"), str(path), "exec", dont_inherit=True)
    except SyntaxError as error:
        text = (error.text or "").strip()
        near = f" in `{text}`" if text else ""
        raise RewardFileError(path, f"{error.msg}{near}", "valid Python", line=error.lineno) from None
    except ValueError as error:
        raise RewardFileError(path, f"no Python ({error})", "valid Python") from None


def _run(path: Path, code: types.CodeType, module: types.ModuleType, reward: RewardFunction) -> None:
    """Run the user's module once, with its folder importable, and lead the prints of its siblings the same way."""
    folder = str(path.resolve().parent)
    for name in _siblings:
        sys.modules.pop(name, None)
    _siblings.clear()
    importlib.invalidate_caches()
    before = set(sys.modules)
    sys.path.insert(0, folder)
    try:
        exec(code, vars(module))
    except (Exception, SystemExit) as error:
        inside = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
        line = inside[-1].lineno if inside else None
        cure = ""
        if isinstance(error, ModuleNotFoundError):
            cure = f"Install '{error.name}' into this environment, or put {error.name}.py beside the file."
        found = f"{type(error).__name__} while it was imported: {error}"
        raise RewardFileError(path, found, "a module that can be imported", cure, line=line) from error
    finally:
        sys.path.remove(folder)
        _adopt_siblings(Path(folder), set(sys.modules) - before, reward)
    if folder not in sys.path:
        sys.path.append(folder)  # for imports inside functions; last, so that nobody else's names are taken


def _adopt_siblings(folder: Path, new: set[str], reward: RewardFunction) -> None:
    for name in new:
        module = sys.modules.get(name)
        origin = getattr(module, "__file__", None)
        top = name.split(".")[0]
        if module is not None and origin and Path(origin).resolve().is_relative_to(folder):
            beside = (folder / f"{top}.py").exists() or (folder / top / "__init__.py").exists()
            if beside:
                _siblings.add(name)
                vars(module).setdefault("print", reward.print)


def _find_function(path: Path, source: str, module: types.ModuleType) -> Callable[[Params], Any]:
    function = getattr(module, "reward_function", None)
    if function is None:
        function = getattr(getattr(module, "reward", None), "reward_function", None)
    if function is None:
        names = [name for name, value in vars(module).items() if callable(value) and not name.startswith("_")]
        names = [name for name in names if getattr(vars(module)[name], "__module__", None) == module.__name__]
        if hasattr(getattr(module, "Reward", None), "reward_function"):
            cure = "Add the line `reward = Reward()` at the end."
        else:
            cure = f"{nearest('reward_function', names)} Rename it." if names else ""
        raise RewardFileError(path, "there is no function `reward_function`", _KIND, cure, key="reward_function")
    if not callable(function):
        raise RewardFileError(path, f"`reward_function` is {_short(function)}", _KIND, key="reward_function")
    try:
        inspect.signature(function).bind({})
    except TypeError:
        line = getattr(getattr(function, "__code__", None), "co_firstlineno", None)
        found = f"`reward_function{inspect.signature(function)}` cannot be called with one parameter"
        raise RewardFileError(path, found, "`def reward_function(params):`", line=line, key="reward_function") from None
    except ValueError:
        pass  # a compiled function hides its parameters; the first call will tell
    return function


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
    text = repr(value)
    return text if len(text) <= 200 else f"{text[:200]}..."


def _situation(offset: float = 0.1, **changes: Any) -> Params:
    """Return the parameters of a car `offset` metres right of the centre line of a round track."""
    corners = 40
    circle = [
        (4 * math.sin(2 * math.pi * k / corners), -4 * math.cos(2 * math.pi * k / corners)) for k in range(corners)
    ]
    params: Params = {
        "all_wheels_on_track": True,
        "x": 0.0,
        "y": -4.0 - offset,
        "heading": 0.0,
        "distance_from_center": offset,
        "projection_distance": 0.0,
        "progress": 0.4,
        "steps": 2.0,
        "speed": 1.0,
        "steering_angle": 0.0,
        "track_width": 1.0,
        "track_length": 25.1,
        "waypoints": [*circle, circle[0]],
        "closest_waypoints": [0, 1],
        "is_left_of_center": False,
        "is_reversed": False,
        "is_crashed": False,
        "is_offtrack": False,
        "closest_objects": [0, 0],
        "objects_location": [],
        "objects_left_of_center": [],
        "objects_distance": [],
        "objects_distance_from_center": [],
        "objects_heading": [],
        "objects_speed": [],
        "object_in_camera": False,
        "sim_time": 1.0,
    }
    return {**params, **changes}


_DEFAULT_SOURCE = '''\
"""Pay the car for staying near the centre line.

`params` tells where the car is and what it does at this moment; the number returned is its pay for this moment.
Change the shares and the pay below, train again, and see what the car makes of it.
"""


def reward_function(params):
    """Return the reward for one tick."""
    # How far the car is from the centre line, in metres, and how wide the track is here.
    distance = params["distance_from_center"]
    width = params["track_width"]

    # Three bands round the centre line: the nearer, the more.
    if distance <= 0.10 * width:
        return 1.0
    if distance <= 0.25 * width:
        return 0.5
    if distance <= 0.50 * width:
        return 0.1

    # Beyond the border: next to nothing, but not zero, so that less bad is still told from worse.
    return 1e-3
'''
