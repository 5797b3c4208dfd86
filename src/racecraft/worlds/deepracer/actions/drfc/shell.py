"""The variables of a DeepRacer-for-Cloud folder in the language of a shell. Begin with `shell_lines`."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterator

from racecraft.worlds.deepracer.files.drfc_folder import LOADED, DrfcFolder

SHELLS = ("sh", "powershell")


def shell_lines(drfc: DrfcFolder, shell: str) -> Iterator[str]:
    """Yield the lines by which a shell (one of SHELLS) takes over an installation's variables."""
    from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME

    values = {name: value for name, value in drfc.env.run.values.items() if name in BY_NAME}
    values |= {LOADED: drfc.digest, "DR_RUN_ID": str(drfc.run_id)}
    kept = ("DR_DIR", "DR_CONFIG")
    gone = [name for name in os.environ if name in BY_NAME and name.startswith("DR_") and name not in (*values, *kept)]
    for name in gone:
        yield f"unset {name}" if shell == "sh" else f"Remove-Item Env:{name} -ErrorAction SilentlyContinue"
    for name, value in values.items():
        if name not in kept:
            quoted = shlex.quote(value) if shell == "sh" else _quoted_for_powershell(value)
            yield f"export {name}={quoted}" if shell == "sh" else f"$env:{name} = {quoted}"


def _quoted_for_powershell(value: str) -> str:
    """Return an expression for a value in ASCII: Windows reads what a program writes in another alphabet than it wrote.

    >>> print(_quoted_for_powershell("it's \u2019so\u2019"))
    'it''s ' + [char]0x2019 + 'so' + [char]0x2019
    >>> print(_quoted_for_powershell("\U0001f3ce"), _quoted_for_powershell(""))
    '' + [char]0xd83c + [char]0xdfce ''
    """
    parts = ["'" + re.sub("'", "''", part) + "'" if part.isascii() else _utf16_codes(part) for part in _runs(value)]
    return " + ".join(parts if parts and parts[0].startswith("'") else ["''", *parts])


def _runs(value: str) -> list[str]:
    """Return a value cut into runs of ASCII and of other letters."""
    return [run for run in re.split("([^\x00-\x7f]+)", value) if run]


def _utf16_codes(run: str) -> str:
    """Return letters as the numbers that PowerShell counts them by, UTF-16."""
    pairs = run.encode("utf-16-be", "surrogatepass")
    return " + ".join(f"[char]0x{pairs[at]:02x}{pairs[at + 1]:02x}" for at in range(0, len(pairs), 2))
