"""How a reward came about: each number that a line of the racer's file assigned, and no others."""

import json
import sys

import pytest

from racecraft.contract.errors import RewardError
from racecraft.worlds.deepracer.files.reward_file import load_reward_function
from racecraft.worlds.deepracer.files.reward_trace import RewardTrace, Term, Traced, line_of

TEXT = """\
from helper_traced import twice
def part(x):
    y = x + 1
    return y
def reward_function(params):
    speed = params["speed"]
    word = "fast"
    pay = 1.0
    for k in range(3):
        pay = pay + k
    total = sum(j for j in range(4))
    pay = twice(pay) + part(speed)
    same = same_again = pay
    pay = pay
    return pay"""


@pytest.fixture
def trace(tmp_path):
    (tmp_path / "helper_traced.py").write_text("def twice(x):\n    z = 2 * x\n    return z\n")
    (tmp_path / "reward_function.py").write_text(TEXT)
    return RewardTrace(load_reward_function(tmp_path / "reward_function.py"))


def test_every_number_that_a_line_gave_is_kept_by_line_and_name(trace):
    """Of the loop its last turn: 1 + 0 + 1 + 2 = 4; then 2 * 4 + (2 + 1) = 11."""
    before = sys.gettrace()
    assert trace.call({"speed": 2.0}) == 11.0
    assert sys.gettrace() is before
    assert trace.traced.terms == {
        Term(3, "y"): 3, Term(6, "speed"): 2, Term(8, "pay"): 1, Term(9, "k"): 2, Term(10, "pay"): 4,
        Term(11, "total"): 6, Term(12, "pay"): 11, Term(13, "same"): 11, Term(13, "same_again"): 11,
    }  # fmt: skip
    assert trace.traced.values["pay"] == 11
    assert trace.traced == Traced.of(json.loads(json.dumps(trace.traced.as_list())))


def test_a_term_is_shown_with_its_line(trace):
    shown = [line_of(trace.reward.source, Term(line, "")) for line in (1, 6, 15, 16)]
    assert shown == ["from helper_traced import twice", 'speed = params["speed"]', "return pay", ""]


def test_a_reward_that_fails_has_told_what_it_reached(trace):
    before = sys.gettrace()
    with pytest.raises(RewardError, match="KeyError"):
        trace.call({})
    assert sys.gettrace() is before
    assert trace.traced.terms == {}


def test_lines_that_change_a_number_in_any_way_are_seen(tmp_path):
    """By a field, a function within, an import, a walrus, a match, and anew after `del`; lines that cannot are not."""
    text = """\
class Car:
    def reward_function(self, params):
        count = 1
        def more():
            nonlocal count
            count = 5
        self.laps = 2
        more()
        from helper_traced import SPEED as speed
        self.drive()
        match params:
            case {"steps": steps}:
                pass
        if (pay := steps + 1) > 0:
            del pay
        (pay,
         rest) = 4, 1
        return pay
    def drive(self):
        self.laps += 1
def reward_function(params):
    return Car().reward_function(params)"""
    (tmp_path / "helper_traced.py").write_text("SPEED = 3.0")
    (tmp_path / "reward_function.py").write_text(text)
    trace = RewardTrace(load_reward_function(tmp_path / "reward_function.py"))
    assert trace.call({"steps": 3}) == 4.0
    assert [(line, name, before, now) for line, name, before, now, _ in trace.steps] == [
        (3, "count", None, 1), (7, "self.laps", None, 2), (6, "count", 1, 5), (8, "count", 1, 5),
        (9, "speed", None, 3), (20, "self.laps", 2, 3), (10, "self.laps", 2, 3), (12, "steps", None, 3),
        (14, "pay", None, 4), (16, "pay", None, 4), (17, "rest", None, 1),
    ]  # fmt: skip


def test_a_number_that_no_float_holds_is_left_out(tmp_path):
    text = "def reward_function(params):\n    huge = 10**400\n    pay = 2\n    return pay\n"
    (tmp_path / "reward_function.py").write_text(text)
    trace = RewardTrace(load_reward_function(tmp_path / "reward_function.py"))
    assert trace.call({}) == 2.0
    assert trace.traced.terms == {Term(3, "pay"): 2.0}
