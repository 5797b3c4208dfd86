"""Loggers with one level for all of them, as ML-Agents' scripts ask for them."""

from __future__ import annotations

import logging
import sys

CRITICAL, FATAL, ERROR = logging.CRITICAL, logging.FATAL, logging.ERROR
WARNING, INFO, DEBUG, NOTSET = logging.WARNING, logging.INFO, logging.DEBUG, logging.NOTSET

_SHORT = logging.Formatter("[%(levelname)s] %(message)s")
_LONG = logging.Formatter("%(asctime)s %(levelname)s [%(filename)s:%(lineno)d] %(message)s", "%Y-%m-%d %H:%M:%S")

_handlers: dict[str, logging.Handler] = {}
_level = NOTSET


def get_logger(name: str) -> logging.Logger:
    """Return a logger that writes to standard output, at the level set for all of them."""
    logger = logging.getLogger(name)
    if name not in _handlers:
        _handlers[name] = logging.StreamHandler(sys.stdout)
        logger.addHandler(_handlers[name])
    _set(name)
    return logger


def set_log_level(log_level: int) -> None:
    """Set the level of every logger asked for so far, and of those to come."""
    global _level
    _level = log_level
    for name in _handlers:
        _set(name)


def _set(name: str) -> None:
    if _level != NOTSET:
        logging.getLogger(name).setLevel(_level)
    _handlers[name].setFormatter(_LONG if _level == DEBUG else _SHORT)


__all__ = [
    "CRITICAL", "DEBUG", "ERROR", "FATAL", "INFO", "NOTSET", "WARNING", "get_logger", "set_log_level",
]  # fmt: skip
