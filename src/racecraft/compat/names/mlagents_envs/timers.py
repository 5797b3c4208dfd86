"""How long things take, as a tree of named blocks; one tree a thread.

with hierarchical_timer("act"):
    ...
get_timer_tree()
"""

from __future__ import annotations

import functools
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

TIMER_FORMAT_VERSION = "0.1.0"

Function = TypeVar("Function", bound=Callable[..., Any])


class TimerNode:
    """A named block: seconds in all, how often, and the blocks inside it."""

    def __init__(self) -> None:
        self.children: dict[str, TimerNode] = {}
        self.total, self.count = 0.0, 0

    def get_child(self, name: str) -> TimerNode:
        """Return a block inside this one."""
        return self.children.setdefault(name, TimerNode())

    def add_time(self, elapsed: float) -> None:
        """Count one more run."""
        self.total += elapsed
        self.count += 1

    def tree(self) -> dict[str, Any]:
        """Return this block as plain values."""
        own = max(0.0, self.total - sum(child.total for child in self.children.values()))
        tree: dict[str, Any] = {"total": self.total, "count": self.count, "self": own}
        if self.children:
            tree["children"] = {name: child.tree() for name, child in self.children.items()}
        return tree


class GaugeNode:
    """A figure: its last value, the smallest, the largest, and how often it was set."""

    def __init__(self, value: float) -> None:
        self.value = self.min_value = self.max_value = value
        self.count = 1

    def update(self, new_value: float) -> None:
        """Set it again."""
        self.value, self.count = new_value, self.count + 1
        self.min_value, self.max_value = min(self.min_value, new_value), max(self.max_value, new_value)

    def as_dict(self) -> dict[str, float]:
        """Return it as plain values."""
        return {"value": self.value, "min": self.min_value, "max": self.max_value, "count": self.count}


class TimerStack:
    """One thread's tree, and where in it the thread is."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self.root, self.gauges = TimerNode(), dict[str, GaugeNode]()
        self.metadata: dict[str, str] = {}
        self._stack, self._begun, self._wall = [self.root], time.perf_counter(), time.time()

    def push(self, name: str) -> TimerNode:
        """Enter a block."""
        self._stack.append(self._stack[-1].get_child(name))
        return self._stack[-1]

    def pop(self) -> None:
        """Leave it."""
        self._stack.pop()

    def set_gauge(self, name: str, value: float) -> None:
        """Set a figure; what is no number is passed over."""
        if value != value:
            return
        if name in self.gauges:
            self.gauges[name].update(value)
        else:
            self.gauges[name] = GaugeNode(value)

    def get_root(self) -> TimerNode:
        """Return the whole tree, its time up to now."""
        self.root.total, self.root.count = time.perf_counter() - self._begun, 1
        return self.root

    def get_timing_tree(self) -> dict[str, Any]:
        """Return everything as plain values."""
        tree = {"name": "root", **self.get_root().tree()}
        if self.gauges:
            tree["gauges"] = {name: gauge.as_dict() for name, gauge in self.gauges.items()}
        tree["metadata"] = {
            "timer_format_version": TIMER_FORMAT_VERSION,
            "start_time_seconds": str(int(self._wall)),
            "end_time_seconds": str(int(time.time())),
            "python_version": sys.version,
            "command_line_arguments": " ".join(sys.argv),
            **self.metadata,
        }
        return tree


_of_thread = threading.local()


def _get_thread_timer() -> TimerStack:
    if not hasattr(_of_thread, "stack"):
        _of_thread.stack = TimerStack()
    stack: TimerStack = _of_thread.stack
    return stack


@contextmanager
def hierarchical_timer(name: str, timer_stack: TimerStack | None = None) -> Iterator[TimerNode]:
    """Time a block; blocks inside it are its children."""
    stack = timer_stack or _get_thread_timer()
    node, started = stack.push(name), time.perf_counter()
    try:
        yield node
    finally:
        node.add_time(time.perf_counter() - started)
        stack.pop()


def timed(func: Function) -> Function:
    """Time a function, under its qualified name."""

    @functools.wraps(func)
    def wrapped(*args: Any, **words: Any) -> Any:
        with hierarchical_timer(func.__qualname__):
            return func(*args, **words)

    return wrapped  # type: ignore[return-value]


def set_gauge(name: str, value: float, timer_stack: TimerStack | None = None) -> None:
    """Set a figure."""
    (timer_stack or _get_thread_timer()).set_gauge(name, value)


def add_metadata(key: str, value: str, timer_stack: TimerStack | None = None) -> None:
    """Add a line about the run."""
    (timer_stack or _get_thread_timer()).metadata[key] = value


def get_timer_tree(timer_stack: TimerStack | None = None) -> dict[str, Any]:
    """Return everything as plain values."""
    return (timer_stack or _get_thread_timer()).get_timing_tree()


def get_timer_root(timer_stack: TimerStack | None = None) -> TimerNode:
    """Return the tree."""
    return (timer_stack or _get_thread_timer()).get_root()


def reset_timers(timer_stack: TimerStack | None = None) -> None:
    """Begin anew."""
    (timer_stack or _get_thread_timer()).reset()


__all__ = [
    "TIMER_FORMAT_VERSION", "GaugeNode", "TimerNode", "TimerStack", "add_metadata", "get_timer_root",
    "get_timer_tree", "hierarchical_timer", "reset_timers", "set_gauge", "timed",
]  # fmt: skip
