"""What a reward's text tells before it is run."""

import ast

import pytest

from racecraft.worlds.deepracer.files.reward_analysis import analyse
from racecraft.worlds.deepracer.files.reward_file import default_reward_source, load_reward_function

BODY = "def reward_function(params):\n    return 1.0\n"


def told(text):
    return analyse(ast.parse(text))


KEEPS = [  # text, line
    ("n = 0\ndef reward_function(p):\n    global n\n    n += 1\n    return n\n", 3),
    ("seen = []\ndef reward_function(p):\n    seen.append(p['x'])\n    return len(seen)\n", 1),
    ("class Car:\n    last = 0\ndef reward_function(p):\n    Car.last += 1\n    return Car.last\n", 4),
    ("class Car:\n    pass\nreward = Car()\n" + BODY, 3),
    ("def reward_function(p):\n    reward_function.n = 1\n    return 1\n", 2),
    ("def reward_function(p):\n    setattr(reward_function, 'n', 1)\n    return 1\n", 2),
    ("def reward_function(p, seen=[]):\n    seen.append(1)\n    return len(seen)\n", 1),
    ("def reward_function(p, *, seen={}):\n    return 1\n", 1),
    ("import functools\n@functools.lru_cache\ndef far(x):\n    return x\n" + BODY, 2),
    ("def made():\n    n = 0\n    def pay(p):\n        nonlocal n\n        n += 1\n    return pay\n", 4),
    ("def made():\n    return lambda p: 1\nreward_function = made()\n", 3),
    ("def reward_function(p):\n    globals()['n'] = 1\n    return 1\n", 2),
    ("import racing_line\n" + BODY, 1),
    ("def reward_function(p):\n    from helper import state\n    return state()\n", 2),
]  # fmt: skip


@pytest.mark.parametrize(("text", "line"), KEEPS)
def test_what_can_keep_something_is_said_to_with_its_line(text, line):
    assert told(text).state.line == line


FORGETS = [
    BODY,
    default_reward_source(),
    '"""A text."""\nimport math\nimport numpy as np\nfrom shapely.geometry import Point\nWIDTH = 2 * 0.5\n'
    "TOP: float = -4.0\nPAIR = (1, 2.0)\ndef far(x, y=1.0):\n    seen = []\n    seen.append(x)\n    seen[0] = y\n"
    "    return seen\n" + BODY,
    "class Car:\n    TOP = 4\n    def pay(self, p):\n        return p['speed'] / self.TOP\n"
    "def reward_function(p):\n    return Car().pay(p)\n",
    BODY + "if __name__ == '__main__':\n    print(reward_function({}))\n",
]


@pytest.mark.parametrize("text", FORGETS)
def test_what_cannot_keep_anything_is_not_copied(text):
    assert told(text).state is None


@pytest.mark.parametrize("compared", ["params['steps'] == 1", "steps <= 1", "2 > int(steps)"])
def test_a_wait_for_a_step_before_the_second_is_named_with_its_line(compared):
    text = "def reward_function(params):\n    steps = params['steps']\n    if " + compared
    remark = told(text + ":\n        return 9.0\n    return 1.0\n").remarks[0]
    assert remark.line == 3
    assert "never holds: `steps` is 2.0 at the first call of an episode" in remark.text


TALE = """
from racing_helper import Memory
count = 0
class Car:
    total = 0
    def pay(self): Car.total += 1; return Car.total
def reward_function(params, seen=[]):
    global count
    from racing_helper import Memory as late
    count += 1
    seen.append(0)
    reward_function.calls = getattr(reward_function, "calls", 0) + 1
    Memory.n += 1
    late.n += 1
    return count + 10 * len(seen) + 100 * Car().pay() + 1000 * reward_function.calls + 10000 * Memory.n
"""


def test_each_car_has_globals_class_state_defaults_and_modules_of_its_own(tmp_path):
    """By hand: the k-th call of a car sees k everywhere, whatever others did; the module beside counts twice a call."""
    (tmp_path / "racing_helper.py").write_text("class Memory:\n    n = 0\n")
    path = tmp_path / "reward_function.py"
    path.write_text(TALE)
    first, second, third = load_reward_function(path).copies(3)
    assert [first.call({}), first.call({}), second.call({}), first.call({})] == [21111, 42222, 21111, 63333]
    assert [third.call({}), second.call({})] == [21111, 42222]


def test_copies_are_of_what_was_read_first_and_say_nothing_when_loaded(tmp_path, capsys):
    (tmp_path / "racing_helper.py").write_text("PAY = 1\nprint('helper')\n")
    path = tmp_path / "reward_function.py"
    path.write_text(
        "import racing_helper\nprint('loaded')\n"
        "def reward_function(p):\n    print('called')\n    return racing_helper.PAY\n"
    )
    reward = load_reward_function(path)
    (tmp_path / "racing_helper.py").write_text("PAY = 2\n")
    path.write_text("def reward_function(p):\n    return 3\n")
    assert [copy.call({}) for copy in reward.copies(2)] == [1.0, 1.0]
    assert capsys.readouterr().out == "helper\nloaded\ncalled\ncalled\n"


def test_a_reward_without_state_is_one_for_all(tmp_path):
    path = tmp_path / "reward_function.py"
    path.write_text(BODY)
    reward = load_reward_function(path)
    assert all(copy is reward for copy in reward.copies(32))


def test_packages_and_folders_without_init_beside_the_file_are_imported_from_there(tmp_path):
    for name, text in {
        "geometry_here/__init__.py": "from geometry_here.lines import far\nfrom . import other\n",
        "geometry_here/lines.py": "import math\ndef far(x): return math.fabs(x)\n",
        "geometry_here/other.py": "TWO = 2\n",
        "plain_here/deep/thing.py": "import lone_here\nTHREE = lone_here.THREE\n",
        "lone_here.py": "THREE = 3\n",
        "unneeded.py": "raise SystemExit\n",
        "math.py": "raise SystemExit\n",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    path = tmp_path / "reward_function.py"
    path.write_text(
        "import geometry_here, math\nfrom plain_here.deep import thing\n"
        "def reward_function(p):\n    return geometry_here.far(-1) + geometry_here.other.TWO + thing.THREE"
        " + math.sqrt(4)\n"
    )
    import sys

    before = (set(sys.modules), list(sys.path), list(sys.meta_path))
    reward = load_reward_function(path)
    assert [copy.call({}) for copy in (reward, *reward.copies(2))] == [8.0] * 3
    assert set(reward.source.modules) == {
        "geometry_here/__init__.py", "geometry_here/lines.py", "geometry_here/other.py", "plain_here/deep/thing.py",
        "lone_here.py",
    }  # fmt: skip
    left = {name for name in set(sys.modules) - before[0] if not name.startswith("racecraft_reward_")}
    assert (left, sys.path, sys.meta_path) == (set(), *before[1:])
    assert not list(tmp_path.rglob("__pycache__"))


STATES = [  # text, line, what is shown
    ("x = 1\nprint(x)\n" + BODY, 2, "`print(x)`"),
    ("x: dict = {}\n" + BODY, 1, "`x: dict = {}`"),
    ("a, b = 1, 2\n" + BODY, 1, "`a, b = (1, 2)`"),
    ("if __name__ == '__main__':\n    pass\nelse:\n    x = 1\n" + BODY, 1, "`if __name__ == '__main__':`"),
    (BODY + "def far(x, y=[1]):\n    return x\n", 3, "the default `[1]`"),
    ("def f(p):\n    p.x = 1\n", 2, "`p.x` is set"),
    ("def f(p):\n    return eval('1')\n", 2, "`eval`"),
    ("import math\nimport b.c\n\nimport a\n" + BODY, 2, "the module `b`"),
]


@pytest.mark.parametrize(("text", "line", "shown"), STATES)
def test_what_can_keep_something_is_shown_as_it_is_written(text, line, shown):
    found = told(text).state
    assert (found.line, found.text) == (line, shown)


@pytest.mark.parametrize(
    "text",
    ["x: int\n", "x = -1 if True else not 2\n", "if '__main__' == __name__:\n    x = []\n", "from scipy import a\n"],
)
def test_what_is_plainly_stateless_is_not_copied(text):
    assert told(text + BODY).state is None


def test_what_is_imported_is_told_by_first_names_without_neighbours():
    text = "import b.c, a\nfrom . import x\nfrom .y import z\nfrom d.e import f\ndef g():\n    import h\n"
    assert told(text).imports == ("a", "b", "d", "h")


WAITS = [
    ("2 > {}", True), ("2.5 > {}", False), ("{} <= 1.9", True), ("{} <= 2", False), ("{} == 300", False),
    ("{} == '1'", False), ("{} % 1 == 0", False),
]  # fmt: skip


@pytest.mark.parametrize(("compared", "is_vain"), WAITS)
def test_a_comparison_is_vain_where_no_step_from_the_second_on_fulfils_it(compared, is_vain):
    text = "def reward_function(params):\n    return float(" + compared.format("params['steps']") + ")\n"
    assert bool(told(text).remarks) is is_vain


NAMED = [
    ("n: float = params['steps']", "n", True),
    ("self.n = params['steps']", "self.n", True),
    ("n = round(float(params['steps']))", "n", True),
    ("n = abs(params['steps'])", "n", False),
    ("pass", "params.get('steps', 0)", True),
    ("pass", "params['steps', 1]", False),
]


@pytest.mark.parametrize(("line", "name", "is_known"), NAMED)
def test_steps_are_known_under_the_names_they_are_given(line, name, is_known):
    text = f"def reward_function(params, self=None):\n    {line}\n    return float({name} == 1)\n"
    assert bool(told(text).remarks) is is_known


def test_objects_are_named_in_order_at_the_first_line_that_reads_of_them():
    text = "def reward_function(p):\n    a = p['x']\n    b = p.get('objects_speed')\n    c = p['object_in_camera']\n"
    (remark,) = told(text + "    return p['objects_speed'][0]\n").remarks
    assert remark.line == 3
    assert remark.text.startswith("`object_in_camera`, `objects_speed`: a time trial has no objects, so lists of them")
    assert told("def reward_function(p):\n    return p['is_crashed']\n").remarks == ()
