"""Cores for a thread of its own: which ones, who is refused, and that they are given back."""

import gc
import os
import threading

import pytest

from racecraft.algorithms.own_cores import keep_to, keep_to_while, split_cores
from racecraft.contract.errors import SettingError


@pytest.fixture
def told(monkeypatch):
    """Have five cores, and write down who is kept to which."""
    asked = []
    monkeypatch.setattr(
        os, "sched_getaffinity", lambda thread: {3, 0, 5, 1, 2} if thread == 0 else set(), raising=False
    )
    monkeypatch.setattr(os, "sched_setaffinity", lambda *asks: asked.append(asks), raising=False)
    return asked


def test_the_last_cores_are_split_off_and_one_is_left_at_least(told):
    assert split_cores(2, "apex.learner_cores") == ({3, 5}, {0, 1, 2})
    assert split_cores(4, "apex.learner_cores") == ({1, 2, 3, 5}, {0})
    with pytest.raises(SettingError, match=r"apex\.learner_cores=5: 5 cores may be used.*expected 0 to 4\."):
        split_cores(5, "apex.learner_cores")


def test_one_core_is_spoken_of_as_one(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda thread: {7}, raising=False)
    with pytest.raises(SettingError, match="1 core may be used here.*expected 0 to 0"):
        split_cores(1, "x")


def test_a_system_without_cores_for_threads_is_named(monkeypatch):
    monkeypatch.delattr(os, "sched_setaffinity", raising=False)
    with pytest.raises(SettingError, match="this system gives threads no cores"):
        split_cores(1, "apex.learner_cores")


def test_a_thread_keeps_to_its_cores_until_their_owner_is_gone(told):
    class Owner:
        pass

    keep_to({5})
    owner = Owner()
    keep_to_while(owner, {0, 1})
    assert told == [(0, {5}), (0, {0, 1})]
    del owner
    gc.collect()
    assert told[2:] == [(threading.get_native_id(), {0, 1, 2, 3, 5})]


def test_a_thread_that_is_gone_wants_nothing_back(told, monkeypatch):
    class Owner:
        pass

    owner = Owner()
    keep_to_while(owner, {0})

    def gone(*asks):
        raise OSError("no such thread")

    monkeypatch.setattr(os, "sched_setaffinity", gone)
    del owner
    gc.collect()
