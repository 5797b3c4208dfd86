"""Where a player's file is, and starting it by hand. `UnityEnvironment` finds and starts its own."""

from __future__ import annotations

import glob
import os
import subprocess
import sys
from collections.abc import Sequence

from racecraft.compat.names.mlagents_envs.exception import UnityEnvironmentException

_SUFFIXES = (".app", ".exe", ".x86_64", ".x86")


def get_platform() -> str:
    """Return `linux`, `darwin` or `win32`."""
    return sys.platform


def validate_environment_path(env_path: str) -> str | None:
    """Return the player that a path names, with or without its suffix; None where there is none for this platform."""
    path = env_path.strip()
    for suffix in _SUFFIXES:
        path = path.removesuffix(suffix)
    if not (glob.glob(path) or glob.glob(f"{path}.*")):
        return None
    for pattern in _patterns(path):
        found = glob.glob(pattern)
        if len(found) > 0:
            return found[0]
    return path if get_platform().startswith("linux") and os.path.isfile(path) else None


def launch_executable(file_name: str, args: Sequence[str]) -> subprocess.Popen[bytes]:
    """Start a player in a group of its own.

    Raises:
        UnityEnvironmentException: There is no such player, or it may not be started.
    """
    player = validate_environment_path(file_name)
    if player is None:
        raise UnityEnvironmentException(
            f"{file_name}: no player for {get_platform()} stands there; expected a file such as {file_name}"
            f"{_SUFFIXES[2]}"
        )
    try:
        return subprocess.Popen(
            [player, *args], start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
    except PermissionError as cause:
        raise UnityEnvironmentException(f"{player}: may not be started ({cause}). Try: chmod +x '{player}'") from cause


def _patterns(path: str) -> list[str]:
    name = os.path.basename(os.path.normpath(path))
    match get_platform():
        case "darwin":
            inside = os.path.join(f"{path}.app", "Contents", "MacOS")
            return [os.path.join(inside, name), os.path.join(inside, "*")]
        case "win32":
            return [f"{path}.exe", os.path.join(path, "[!U]*.exe"), os.path.join(path, "U[!n]*.exe")]
    return [f"{path}.x86_64", f"{path}.x86"]


__all__ = ["get_platform", "launch_executable", "validate_environment_path"]
