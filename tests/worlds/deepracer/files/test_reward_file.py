"""`reward_function.py`: loaded unchanged, called cheaply, answered with letters."""

import io
import itertools
import linecache
import signal
import sys

import pytest

from racecraft.contract.errors import RewardError, RewardFileError
from racecraft.worlds.deepracer.files.reward_file import (
    default_reward_source,
    example_situations,
    load_reward_function,
    validate,
)


def written(tmp_path, text, name="reward_function.py"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def loaded(tmp_path, text, output=None):
    return load_reward_function(written(tmp_path, text), output)


@pytest.fixture(autouse=True)
def _the_path_as_it_was(monkeypatch):

    monkeypatch.setattr(sys, "path", list(sys.path))


def test_our_own_reward_pays_by_bands_of_the_width(tmp_path):
    reward = loaded(tmp_path, default_reward_source())
    pays = [
        reward.call({"distance_from_center": share * 0.8, "track_width": 0.8})
        for share in (0.0, 0.0999, 0.11, 0.2499, 0.26, 0.4999, 0.51)
    ]
    assert pays == [1.0, 1.0, 0.5, 0.5, 0.1, 0.1, 1e-3]
    assert set(validate(reward)) == set(example_situations())


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("True", 1.0),
        ("numpy.float32(0.5)", 0.5),
        ("numpy.array(1.5)", 1.5),
        ("'1.0'", 1.0),
        ("numpy.full((1, 1), 2.5)", 2.5),
        ("__import__('decimal').Decimal('0.5')", 0.5),
    ],
)
def test_every_kind_of_number_becomes_a_float(tmp_path, text, number):
    got = loaded(tmp_path, f"import numpy\ndef reward_function(params):\n    return {text}\n").call({})
    assert type(got) is float
    assert got == number


def test_state_of_the_module_lives_on_and_each_load_has_its_own(tmp_path):
    text = "count = 0\ndef reward_function(params):\n    global count\n    count += 1\n    return count\n"
    first, second = loaded(tmp_path, text), loaded(tmp_path, text)
    assert [first.call({}), first.call({}), second.call({})] == [1.0, 2.0, 1.0]


def test_the_class_idiom_is_understood(tmp_path):
    text = (
        "class Reward:\n    def __init__(self):\n        self.n = 0\n"
        "    def reward_function(self, params):\n        self.n += 1\n        return self.n\n"
        "reward = Reward()\n"
    )
    reward = loaded(tmp_path, text)
    assert [reward.call({}), reward.call({})] == [1.0, 2.0]


def test_prints_go_to_the_log_even_from_a_module_beside_it(tmp_path, capsys):
    written(tmp_path, "def tell(x):\n    print('helper', x)\n    return 1.0\n", "racing_helper.py")
    log = io.StringIO()
    text = "import racing_helper\ndef reward_function(p):\n    print('at', p['x'], sep='=')\n"
    text += "    return racing_helper.tell(2)\n"
    reward = loaded(tmp_path, text, log)
    reward.call({"x": 1})
    assert log.getvalue() == "at=1\nhelper 2\n"
    reward.output = None
    reward.call({"x": 3})
    assert capsys.readouterr().out == "at=3\nhelper 2\n"


def test_modules_beside_two_reward_files_do_not_mix(tmp_path):
    for name, pay in [("a", 1), ("b", 2)]:
        (tmp_path / name).mkdir()
        written(tmp_path / name, f"PAY = {pay}\n", "racing_helper.py")
        written(tmp_path / name, "from racing_helper import PAY\ndef reward_function(p):\n    return PAY\n")
    first = load_reward_function(tmp_path / "a" / "reward_function.py")
    second = load_reward_function(tmp_path / "b" / "reward_function.py")
    assert (first.call({}), second.call({})) == (1.0, 2.0)


def test_a_module_may_be_imported_while_the_function_runs(tmp_path):
    written(tmp_path, "PAY = 7\n", "racing_helper_late.py")
    text = "def reward_function(p):\n    import racing_helper_late\n    return racing_helper_late.PAY\n"
    assert loaded(tmp_path, text).call({}) == 7.0


PARAMS = {"x": 1.25, "waypoints": [(0.0, float(k)) for k in range(119)]}
HEAD = "import numpy\ndef deep(n): return deep(n - 1) if n else numpy.zeros(0)[3]\n"
FAILING = [  # body, line, found
    ("    return None", 3, "returned None, of type NoneType"),
    ("    return 'one'", 3, "returned 'one', of type str"),
    ("    return 10**400", 3, "too large for a number"),
    ("    return float('nan')", 3, "returned nan"),
    ("    return 100001", 3, "returned 100001"),
    ("    return numpy.ones(2)", 3, "of type ndarray"),
    ("    pay = 1\n    return pay / 0", 5, "ZeroDivisionError: division by zero"),
    ("    return deep(3)", 2, "IndexError: index 3"),
    ("    raise KeyboardInterrupt", 4, "KeyboardInterrupt"),
    ("    import sys\n    sys.exit('over')", 5, "SystemExit: over"),
    ("    import shapely_missing", 4, "`python -m pip install shapely_missing`"),
    ("    return reward_function(params)", 4, "RecursionError"),
]


@pytest.mark.parametrize(("body", "line", "found"), FAILING)
def test_a_failing_reward_gets_a_letter_with_line_and_parameters(tmp_path, body, line, found):
    path = written(tmp_path, f"{HEAD}def reward_function(params):\n{body}\n")
    with pytest.raises(RewardError) as caught:
        load_reward_function(path).call(dict(PARAMS))
    letter = str(caught.value)
    assert letter.startswith(f"{path}:{line}: reward_function ")
    assert found in letter
    assert "expected a number" in letter
    assert "x = 1.25" in letter
    assert "waypoints = [(0.0, 0.0), (0.0, 1.0), ... 119 in all]" in letter


ANSWERING = """\
class Pay:
    def {method}(self, *names):
        {statement}
def reward_function(params):
    {answer}
"""
OBJECTS = [  # method, statement, line, found
    ("__float__", "raise RuntimeError('none')", 3, "raised RuntimeError: none"),
    ("__float__", "raise KeyboardInterrupt", 3, "raised KeyboardInterrupt"),
    ("__float__", "return 'fast'", 4, "returned <"),
    ("__getattr__", "raise RuntimeError(names)", 3, "raised RuntimeError: ('size',)"),
    ("__repr__", "raise RuntimeError('none')", 4, "returned a value that cannot be shown (RuntimeError), of type Pay"),
]


@pytest.mark.parametrize(("method", "statement", "line", "found"), OBJECTS)
def test_an_object_that_fails_as_a_number_gets_a_letter(tmp_path, method, statement, line, found):
    path = written(tmp_path, ANSWERING.format(method=method, statement=statement, answer="return Pay()"))
    with pytest.raises(RewardError) as caught:
        load_reward_function(path).call({"x": 1.25})
    assert str(caught.value).startswith(f"{path}:{line}: reward_function {found}")
    assert "x = 1.25" in str(caught.value)


@pytest.mark.parametrize("answer", ["params['x'] = Pay(); return 1 / 0", "params['x'] = [Pay()] * 7; return 1 / 0"])
def test_a_parameter_that_cannot_be_shown_hides_no_fault(tmp_path, answer):
    text = ANSWERING.format(method="__repr__", statement="raise SystemExit", answer=answer)
    with pytest.raises(RewardError, match=r"reward_function\.py:5: reward_function raised ZeroDivisionError") as caught:
        loaded(tmp_path, text).call({"x": 1.25})
    assert "a value that cannot be shown (SystemExit)" in str(caught.value)


@pytest.mark.parametrize(
    ("before", "answer", "found"),
    [
        ("class Fault(Exception):\n    def __str__(self):\n        raise SystemExit", "raise Fault",
         "5: reward_function raised Fault: a value that cannot be shown"),
        ("def inner():\n    raise KeyboardInterrupt", "return inner()", "2: reward_function raised KeyboardInterrupt"),
        ("import functools\ndef pay(p, k):\n    return k", "pass\nreward_function = functools.partial(pay, k=None)",
         "1: reward_function returned None"),
    ],
    ids=["not to be shown", "Ctrl-C of its own", "no plain function"],
)  # fmt: skip
def test_a_fault_is_told_with_its_line(tmp_path, before, answer, found):
    text = f"{before}\ndef reward_function(params):\n    {answer}\n"
    with pytest.raises(RewardError, match=rf"reward_function\.py:{found}"):
        loaded(tmp_path, text).call({})


@pytest.fixture
def heeded():
    """Ctrl-C is heard, even where the tests run in the background, which turns it off."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heeded")
def test_a_persons_ctrl_c_is_no_fault_of_the_reward(tmp_path):
    press = "import signal\ndef reward_function(p):\n    signal.raise_signal(signal.SIGINT)\n    return 1\n"
    with pytest.raises(KeyboardInterrupt):
        loaded(tmp_path, press).call({})
    with pytest.raises(KeyboardInterrupt):
        loaded(tmp_path, press + "reward_function(1)\n")
    statement = "import signal; signal.raise_signal(signal.SIGINT)"
    for method in ("__float__", "__repr__"):
        with pytest.raises(KeyboardInterrupt):
            loaded(tmp_path, ANSWERING.format(method=method, statement=statement, answer="return Pay()")).call({})


def test_the_moments_that_a_reward_is_tried_at_follow_one_another():
    """A reward that divides by the steps or the progress since its last call is as good as any (3 of 283 public)."""
    moments = list(example_situations().values())
    for before, after in itertools.pairwise(moments):
        assert all(before[name] < after[name] for name in ("steps", "progress", "sim_time"))


def test_a_reward_that_pays_by_the_steps_since_a_checkpoint_is_taken(tmp_path):
    text = (
        "before = {'steps': 0, 'progress': 0}\n"
        "def reward_function(params):\n"
        "    grew = {name: params[name] - before[name] for name in before}\n"
        "    before.update(steps=params['steps'], progress=params['progress'])\n"
        "    return grew['progress'] / grew['steps']\n"
    )
    assert all(paid > 0 for paid in validate(loaded(tmp_path, text)).values())


def test_a_parameter_that_is_not_there_is_named_with_the_nearest(tmp_path):
    reward = loaded(tmp_path, "def reward_function(params):\n    return params['distance_from_centre']\n")
    with pytest.raises(RewardError, match="Did you mean 'distance_from_center'?"):
        validate(reward)


def test_the_letter_holds_the_line_itself_and_the_traceback_the_users_file(tmp_path):
    path = written(tmp_path, "def reward_function(params):\n    return 1 / params['x']\n")
    with pytest.raises(RewardError) as caught:
        load_reward_function(path).call({"x": 0})
    assert "return 1 / params['x']" in str(caught.value)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)
    assert linecache.getline(str(path), 2).strip() == "return 1 / params['x']"


def test_a_fault_in_a_module_beside_it_is_told_with_both_lines(tmp_path):
    written(tmp_path, "def far(x):\n    return part(x)\n\ndef part(x):\n    return 1 / x\n", "helper.py")
    reward = loaded(tmp_path, "import helper\ndef reward_function(params):\n    return helper.far(params['x'])\n")
    with pytest.raises(RewardError) as caught:
        reward.call({"x": 0})
    line, *_ = str(caught.value).splitlines()
    assert line.startswith(f"{tmp_path / 'reward_function.py'}:3: reward_function raised ZeroDivisionError")
    assert f"(raised in {tmp_path / 'helper.py'}:5)" in line


UNLOADABLE = [  # text, line, found, helped by
    ("", None, "the file is empty", "racecraft new"),
    ("x = 1\ndef reward_function(params)\n    return 1\n", 2, "def reward_function(params)", "valid Python"),
    ("def reward_function(params):\n\treturn 1\n        return 2\n", 3, "inconsistent", "valid Python"),
    ("x = 1\ny = x / 0\n", 2, "ZeroDivisionError", "can be imported"),
    ("import sys\nsys.exit(3)\n", 2, "SystemExit", "can be imported"),
    ("def reward_funktion(params):\n    return 1\n", None, "no function", "Did you mean 'reward_funktion'"),
    ("from scipy_missing import x\n", 1, "ModuleNotFoundError", "`python -m pip install scipy_missing`"),
    ("reward_function = 3\n", None, "`reward_function` is 3", "def reward_function(params)"),
    ("def reward_function():\n    return 1\n", 1, "`reward_function()`", "`def reward_function(params):`"),
    ("class Reward:\n    def reward_function(self, p):\n        return 1\n", None, "no function", "reward = Reward()"),
    ("x = '\x00'\n", None, "null bytes", "valid Python" if sys.version_info < (3, 14) else "UTF-8"),
]


@pytest.mark.parametrize(("text", "line", "found", "hint"), UNLOADABLE)
def test_a_file_that_cannot_be_loaded_gets_a_letter(tmp_path, text, line, found, hint):
    path = written(tmp_path, text)
    with pytest.raises(RewardFileError) as caught:
        load_reward_function(path)
    letter = str(caught.value)
    assert letter.startswith(str(path) + (f":{line}: " if line else ""))
    assert found in letter
    assert "expected" in letter
    assert hint in letter


def test_a_missing_file_and_a_file_that_is_no_text_get_letters(tmp_path):
    with pytest.raises(RewardFileError, match=r"nothing\.py: there is no such file"):
        load_reward_function(tmp_path / "nothing.py")
    (tmp_path / "r.py").write_bytes(b"x = '\xff\xfe\xfd'\n")
    with pytest.raises(RewardFileError, match="not UTF-8"):
        load_reward_function(tmp_path / "r.py")


def test_a_byte_order_mark_and_windows_line_ends_are_read(tmp_path):
    path = tmp_path / "reward_function.py"
    path.write_bytes(b"\xef\xbb\xbfdef reward_function(params):\r\n    return 1 / 0\r\n")
    with pytest.raises(RewardError, match=r"reward_function\.py:2: "):
        load_reward_function(path).call({})


def test_what_python_only_warns_of_is_not_told(tmp_path):
    """A racer's file of Python 3.6: an escape that is none, a comparison with a number by `is`."""
    text = 'def reward_function(params):\n    "Pays \\d."\n    return 2.0 if params["x"] is 1 else 1.0\n'
    assert loaded(tmp_path, text).call({"x": 3}) == 1.0


def test_a_first_reward_fits_the_race():
    alone, objects, cars = default_reward_source(), default_reward_source(True), default_reward_source(True, True)
    assert "objects_" not in alone
    assert "nearest object" in objects
    assert "nearest car" in cars


def test_a_car_among_cars_is_paid_for_speed_in_the_lane_that_is_free(tmp_path):
    """Behind a car on the left of a road 1 m wide: the right lane pays more than the middle, and that than the left."""
    reward = loaded(tmp_path, default_reward_source(has_objects=True, has_rivals=True))
    behind = {**example_situations()["an object ahead"], "projection_distance": 5.5}

    def paid(place, **changes):
        beside = {"distance_from_center": abs(place), "is_left_of_center": place > 0}
        return reward.call({**behind, **beside, **changes})

    assert paid(-0.25) > paid(0.0) > paid(0.25) > 1e-3
    assert paid(-0.25, speed=2.0) == 2 * paid(-0.25, speed=1.0) == 2.0
    assert paid(-0.25, is_crashed=True) == paid(-0.25, is_offtrack=True) == 1e-3
    far = {"projection_distance": 1.0}
    assert paid(0.0, **far) > paid(-0.25, **far), "nobody near: the middle of the road"
    passed = {"projection_distance": 6.3 + 0.3}
    assert paid(-0.25, **passed) > paid(0.0, **passed), "beside the other, until it is passed"
    assert paid(0.0, projection_distance=6.3 + 0.5) > paid(-0.25, projection_distance=6.3 + 0.5)


@pytest.mark.parametrize("pay", ["1e5", "-100000"])
def test_a_reward_of_a_hundred_thousand_is_the_largest(tmp_path, pay):
    """AWS ended a training beyond it."""
    assert loaded(tmp_path, f"def reward_function(p):\n    return {pay}\n").call({}) == float(pay)
    for beyond in (f"{pay} * 1.000001", f"int({pay} * 1.00001)"):
        with pytest.raises(RewardError, match="expected a number from -1e5 to 1e5"):
            loaded(tmp_path, f"def reward_function(p):\n    return {beyond}\n").call({})


def test_what_copies_print_goes_where_the_first_ones_goes(tmp_path, capsys):
    log, other = io.StringIO(), io.StringIO()
    text = "seen = []\ndef reward_function(p):\n    print('here', end='!')\n    print('there', file=p)\n    return 1\n"
    reward = loaded(tmp_path, text, log)
    (copy,) = reward.copies(1)
    (again,) = copy.copies(1)
    for one in (reward, copy, again):
        one.call(other)
    assert (log.getvalue(), other.getvalue(), capsys.readouterr().out) == ("here!" * 3, "there\n" * 3, "")


def test_of_a_fault_deep_in_the_file_the_innermost_line_is_told(tmp_path):
    text = (
        "def part(x):\n    return 1 / x\ndef far(x):\n    return part(x)\ndef reward_function(p):\n    return far(0)\n"
    )
    with pytest.raises(RewardError, match=r"reward_function\.py:2: .*\n    return 1 / x\n"):
        loaded(tmp_path, text).call({})
    with pytest.raises(RewardFileError, match=r"reward_function\.py:2: raised ZeroDivisionError"):
        loaded(tmp_path, text + "far(0)\n")
    with pytest.raises(RewardError, match=r"reward_function\.py:1: .*\n    def reward_function\(p\): return 1 / 0\n"):
        loaded(tmp_path, "def reward_function(p): return 1 / 0").call({})
