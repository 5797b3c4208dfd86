"""A function of ours that a script calls with arguments it does not take, as a letter. Begin with `about_call`.

Python refuses them by the name of our function and tells neither the nearest nor what there is. Which function it was
stands in the script's line; a function of the script's own is left to Python. Functions that take whatever an original
takes refuse by themselves (`contract/arguments.py`).
"""

from __future__ import annotations

import ast
import inspect
import linecache
import re
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any

from racecraft.contract.errors import nearest

OURS = "racecraft."
_UNEXPECTED = re.compile(r"unexpected keyword argument '(\w+)'")
_NAMED = re.compile(r"^[\w.<>]+\(\) ")


def about_call(error: TypeError) -> str:
    """Return what is wrong with the arguments of a call, where a function of ours was called; "" of any other."""
    called = _called(error.__traceback__) if _NAMED.match(str(error)) else None
    if called is None or not str(getattr(called, "__module__", "")).startswith(OURS):
        return ""
    name, text = called.__name__, _NAMED.sub("", str(error))
    known = [one for one in inspect.signature(called).parameters if one not in ("self", "cls")]
    unexpected = _UNEXPECTED.search(text)
    if unexpected is not None:
        return f"{name} has no argument '{unexpected[1]}' here. {nearest(unexpected[1], known)}"
    return f"{name} {text}; expected {name}({', '.join(known)})."


def _called(trace: TracebackType | None) -> Callable[..., Any] | None:
    """Return the function whose arguments could not be laid out, where the innermost line names it plainly."""
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    if trace is None:
        return None
    call = _call_at(trace)
    return None if call is None else _value(call.func, trace.tb_frame)


def _call_at(trace: TracebackType) -> ast.Call | None:
    """Return the call at which a line stopped."""
    code = trace.tb_frame.f_code
    positions = list(code.co_positions())
    line, end, first, last = positions[trace.tb_lasti // 2]
    if line is None or end is None or first is None or last is None:
        return None
    source = linecache.getlines(code.co_filename)[line - 1 : end]
    if not source:
        return None
    source[-1] = source[-1].encode()[:last].decode(errors="ignore")
    source[0] = source[0].encode()[first:].decode(errors="ignore")
    try:
        call = ast.parse("".join(source), mode="eval").body
    except SyntaxError:
        return None
    return call if isinstance(call, ast.Call) else None


def _value(node: ast.expr, frame: FrameType) -> Any:
    """Return what a name, or a name of a name, stands for; of what a class makes, the class. None: not plain."""
    if isinstance(node, ast.Name):
        return frame.f_locals.get(node.id, frame.f_globals.get(node.id))
    if isinstance(node, ast.Attribute):
        whole = _value(node.value, frame)
        return getattr(whole, node.attr, None)
    if isinstance(node, ast.Call):
        made = _value(node.func, frame)
        return made if isinstance(made, type) else None
    return None
