"""A call of a user's code that lasts too long is ended, whatever stands around its endless loop."""

import contextlib
import subprocess
import sys
import threading
import time

import pytest

from racecraft.worlds.deepracer.files.time_limit import CallTooLongError, TimeLimit


def plain(_):
    while True:
        pass


def a_bare_except(_):
    while True:
        try:  # noqa: SIM105
            sum(range(10))
        except:  # noqa: E722
            pass


def two_excepts_one_in_another(_):
    while True:
        try:
            try:  # noqa: SIM105
                list(range(50))
            except:  # noqa: E722
                pass
        except BaseException:
            pass
        finally:
            len("")


def a_loop_that_fails_and_handles(_):
    while True:
        try:
            1 / 0  # noqa: B018
        except:  # noqa: E722
            for _k in range(5):
                pass


def suppression(_):
    while True:
        with contextlib.suppress(BaseException):
            plain(_)


def a_finally_that_goes_on(_):
    while True:
        try:
            len("x")
        finally:
            continue  # noqa: B012


def functions_that_swallow(_):
    def inner():
        try:
            for _k in range(1000):
                pass
        except:  # noqa: E722
            pass

    while True:
        inner()


def a_handler_that_begins_again(_):
    try:
        plain(_)
    except:  # noqa: E722
        a_handler_that_begins_again(_)


ENDLESS = [
    plain,
    a_bare_except,
    two_excepts_one_in_another,
    a_loop_that_fails_and_handles,
    suppression,
    a_finally_that_goes_on,
    functions_that_swallow,
    a_handler_that_begins_again,
]


@pytest.mark.parametrize("endless", ENDLESS)
@pytest.mark.parametrize("in_a_thread", [False, True])
def test_an_endless_loop_is_ended_and_the_next_call_is_not(endless, in_a_thread):
    limit = TimeLimit(0.1)
    said = []

    def ask():
        with pytest.raises(CallTooLongError) as caught:
            limit.call(endless, None)
        for _ in range(200_000):  # nothing may strike afterwards
            pass
        said.append((str(caught.value), limit.call(lambda x: x + 1, 1)))

    if in_a_thread:
        thread = threading.Thread(target=ask, daemon=True)
        thread.start()
        thread.join(60)
    else:
        ask()
    assert said == [("no answer after 0.1 s", 2)]


def test_calls_that_end_in_the_very_moment_answer_or_are_ended_and_nothing_strikes_later():
    limit = TimeLimit(0.01)

    def about_as_long(seconds):
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            pass
        return "answer"

    came = []
    for k in range(60):
        try:
            came.append(limit.call(about_as_long, 0.0095 + 0.00005 * k))
        except CallTooLongError:
            came.append("ended")
    assert set(came) <= {"answer", "ended"}
    assert came.count("ended") > 0


def test_an_answer_that_comes_late_since_the_end_was_caught_is_none():
    """One except: round the whole loop; the call then goes on to its return, some strikes later."""

    def catches(_):
        try:
            while True:
                pass
        except:  # noqa: E722
            pass
        return "answer"

    limit = TimeLimit(0.05)
    for _ in range(10):
        with pytest.raises(CallTooLongError):
            limit.call(catches, None)
    assert limit.call(len, "abc") == 3


def test_what_the_user_raised_comes_through_as_it_is():
    error = KeyError("x")

    def raising(_):
        raise error

    with pytest.raises(KeyError) as caught:
        TimeLimit(5).call(raising, None)
    assert caught.value is error


def test_a_call_that_sits_in_c_is_told_of_once_and_ended_when_it_returns():
    told = []
    with pytest.raises(CallTooLongError):
        TimeLimit(0.05, told.append).call(time.sleep, 0.4)
    assert told == [threading.get_ident()]


@pytest.mark.parametrize("answers", [True, False])
def test_a_watcher_that_is_slow_to_begin_costs_no_call_its_time_and_nobody_is_struck_later(monkeypatch, answers):
    """On a machine under load the thread may need longer to begin than a call may last."""
    begin = threading.Thread.start

    def begin_slowly(thread):
        begin(thread)
        for _ in range(100):  # in steps, for an exception would wait until one sleep returns
            time.sleep(0.003)

    monkeypatch.setattr(threading.Thread, "start", begin_slowly)
    limit = TimeLimit(0.05)
    if answers:
        assert limit.call(lambda value: value + 1, 1) == 2
    else:
        with pytest.raises(ZeroDivisionError):
            limit.call(lambda value: 1 / value, 0)
    assert not limit._due
    ends = time.monotonic() + 0.2
    while time.monotonic() < ends:
        time.sleep(0.001)


def test_a_limit_of_one_call_holds_for_that_call():
    limit = TimeLimit(0.05)
    assert limit.call(lambda x: time.sleep(0.2) or x, 3, seconds=30) == 3
    with pytest.raises(CallTooLongError):
        limit.call(plain, None)


def test_the_thread_goes_when_nothing_is_called_and_comes_back(monkeypatch):
    monkeypatch.setattr("racecraft.worlds.deepracer.files.time_limit.IDLE_LOOKS", 2)
    limit = TimeLimit(0.05)
    limit.call(len, "x")
    watcher = limit._watcher
    watcher.join(10)
    assert not watcher.is_alive()
    with pytest.raises(CallTooLongError):
        limit.call(plain, None)


UNDER_A_PROFILER = """
import sys
from racecraft.worlds.deepracer.files.time_limit import CallTooLongError, TimeLimit

def fails(_): raise ValueError
def hangs(_):
    while True: pass
def answers(_): return 1

limit = TimeLimit(0.05)
for function in (fails, hangs):
    try:
        limit.call(function, None)
    except (ValueError, CallTooLongError):
        pass
    called = []
    sys.setprofile(lambda frame, event, _: called.append(frame.f_code.co_name) if event == "call" else None)
    limit.call(answers, None)
    sys.setprofile(None)
    print(*called)
"""


def test_what_was_ended_leaves_the_interpreter_as_it_was():
    """With an exception asked for and taken back, CPython 3.11 never got past the first line under a profiler."""
    ran = subprocess.run([sys.executable, "-c", UNDER_A_PROFILER], capture_output=True, text=True, timeout=120)
    assert (ran.stderr, ran.stdout.splitlines()) == ("", ["call answers"] * 2)


def test_a_letter_says_how_long_was_waited():
    limit = TimeLimit(0.02)
    with pytest.raises(CallTooLongError, match=r"^no answer after 0\.02 s$"):
        limit.call(plain, None)
    with pytest.raises(CallTooLongError, match=r"^no answer after 0\.04 s$"):
        limit.call(plain, None, seconds=0.04)


def test_an_answer_that_was_given_late_is_told_as_late():
    def catches(_):
        with contextlib.suppress(BaseException):
            plain(None)
        return 1

    with pytest.raises(CallTooLongError, match=r"^(an answer after more than|no answer after) 0\.02 s$"):
        TimeLimit(0.02).call(catches, None)
