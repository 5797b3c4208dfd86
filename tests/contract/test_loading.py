"""Modules beside a racer's file: which are found, that each car has its own, and that nobody else sees them."""

import ast
import io
import sys
import types

import pytest

from racecraft.contract.loading import UserModules, modules_beside
from racecraft.worlds.deepracer.files.reward_file import load_reward_function


def beside(folder, **texts):
    """Write modules of a folder; __ stands for a slash."""
    for name, text in texts.items():
        path = folder / f"{name.replace('__', '/')}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def found_by(folder, text):
    (folder / "reward_function.py").write_text(text)
    return modules_beside(folder / "reward_function.py", ast.parse(text))


def test_what_the_file_needs_is_found_and_what_that_needs(tmp_path):
    beside(tmp_path, first="import second\nimport math\n", second="import first, reward_function\n", third="x = 1\n",
           math="no = 1\n", parts__inner="import fourth\n", fourth="broken(\n", parts__deep__core="")  # fmt: skip
    found = found_by(tmp_path, "import first, math\ndef reward_function(params):\n    from parts.inner import x\n")
    assert set(found) == {"first.py", "second.py", "parts/inner.py", "parts/deep/core.py", "fourth.py"}
    assert found["second.py"] == "import first, reward_function\n"
    assert found_by(tmp_path, "import numpy\n") == {}


def modules(folder, texts):
    code = compile("", "reward_function.py", "exec")
    return UserModules(folder / "reward_function.py", code, texts)


def test_a_name_leads_to_a_module_a_package_or_a_folder(tmp_path):
    beside_it = modules(tmp_path, {"a.py": "", "b/__init__.py": "", "b/c.py": "", "d/e/f.py": ""})
    assert beside_it.tops == {"a", "b", "d"}
    wanted = {"a": ("a.py", False), "b": ("b/__init__.py", True), "b.c": ("b/c.py", False), "d": ("", True),
              "d.e": ("", True), "d.e.f": ("d/e/f.py", False), "c": None, "a.c": None, "e": None}  # fmt: skip
    assert {name: beside_it.file_of(name) for name in wanted} == wanted


def loaded(folder, text, output=None):
    (folder / "reward_function.py").write_text(text)
    return load_reward_function(folder / "reward_function.py", output)


@pytest.fixture
def counting(tmp_path):
    return beside(
        tmp_path, counter_beside="calls = 0\ndef count():\n    global calls\n    calls += 1\n    return calls\n"
    )


def test_a_module_keeps_its_state_from_call_to_call_and_each_car_has_its_own(counting):
    text = "def reward_function(params):\n    import counter_beside\n    return counter_beside.count()\n"
    reward = loaded(counting, text)
    one, other = reward.copies(2)
    assert [one.call({}), one.call({}), other.call({}), one.call({}), reward.call({})] == [1, 2, 1, 3, 1]


def test_nobody_elses_modules_are_touched(counting, monkeypatch):
    strangers = types.ModuleType("counter_beside")
    monkeypatch.setitem(sys.modules, "counter_beside", strangers)
    finders = list(sys.meta_path)
    reward = loaded(
        counting, "import counter_beside\ndef reward_function(params):\n    return counter_beside.count()\n"
    )
    assert reward.call({}) == 1
    assert (sys.modules["counter_beside"], sys.meta_path) == (strangers, finders)
    monkeypatch.delitem(sys.modules, "counter_beside")
    late = loaded(counting, "def reward_function(p):\n    import counter_beside\n    return counter_beside.count()\n")
    assert late.call({}) == 1
    assert "counter_beside" not in sys.modules


def test_packages_import_within_themselves_early_and_late(tmp_path):
    beside(tmp_path, kit__early="from .values import PAY\n", kit__values="PAY = 3\n",
           kit__late="def pay():\n    from .values import PAY\n    return PAY + 1\n")  # fmt: skip
    text = (
        "import kit.early\nfrom kit import late\ndef reward_function(p):\n    return 10 * kit.early.PAY + late.pay()\n"
    )
    assert loaded(tmp_path, text).call({}) == 34.0


def test_everybodys_modules_are_imported_as_ever(tmp_path):
    beside(tmp_path, helper_beside="import math\nPI = math.pi\n")
    text = "import helper_beside, math, os.path\ndef reward_function(p):\n"
    text += (
        "    return [math.pi == helper_beside.PI, __import__('math').e, __import__('math', None, None, ['e']).e][p]\n"
    )
    reward = loaded(tmp_path, text)
    assert [reward.call(0), reward.call(1), reward.call(2)] == pytest.approx([1.0, 2.718281828, 2.718281828])


def test_a_module_knows_where_it_lies_and_prints_to_the_log(tmp_path):
    beside(tmp_path, where_beside="print(__file__)\n", kit_beside__inner="print(__file__)\n")
    said = io.StringIO()
    text = "import where_beside, kit_beside.inner, kit_beside\nprint(__file__, hasattr(kit_beside, '__file__'))\n"
    loaded(tmp_path, text + "def reward_function(p):\n    return 1\n", said)
    places = [tmp_path / name for name in ("where_beside.py", "kit_beside/inner.py", "reward_function.py")]
    assert said.getvalue() == "{}\n{}\n{} False\n".format(*places)


def test_annotations_are_what_python_makes_of_them(tmp_path):
    """Python compiles a text with the future imports of whoever compiles it, unless it is told not to."""
    text = "def f(x: int): ...\nKIND = f.__annotations__['x']\n"
    beside(tmp_path, kinds_beside=text)
    text = f"import kinds_beside\n{text}def reward_function(p):\n    return KIND is int and kinds_beside.KIND is int\n"
    assert loaded(tmp_path, text).call({}) == 1.0
