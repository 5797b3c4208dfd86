"""Tell people elsewhere how a training goes: at its first lap, a record, an error and its end. Begin with `notified`.

Addresses of `--notify`:

    desktop               this machine's own notifications
    https://HOST/PATH     a POST with JSON; Slack, Mattermost and Discord show its "text" or "content"
    mailto:NAME@HOST      an e-mail by the server that RACECRAFT_SMTP names: smtp[s]://[NAME:PASSWORD@]HOST[:PORT]

A message that cannot be sent is said in the log, and the training goes on.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import smtplib
import subprocess
import time
import urllib.request
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from email.message import EmailMessage
from pathlib import Path
from urllib.parse import unquote, urlsplit

from racecraft.contract.errors import SettingError
from racecraft.training.callbacks import Callbacks, IterationReport, TrainingCallback

DESKTOP, MAIL = "desktop", "mailto:"
SMTP_VARIABLE = "RACECRAFT_SMTP"
NOTIFIERS = ("notify-send", "osascript")
"""Programs that show a message: of Linux's desktops, of macOS."""
RECORD_SECONDS = 60.0
"""Records are told at most so often."""
SEND_SECONDS = 10.0
"""An address that takes longer is given up."""
_MAIL_ADDRESS = re.compile(r"[^@\s,;]+@[^@\s,;]+")


def require_addresses(addresses: Sequence[str]) -> tuple[str, ...]:
    """Return addresses that can be sent to.

    Raises:
        SettingError: One of them is none, or this machine shows no notifications.
    """
    for text in addresses:
        if text == DESKTOP and not any(map(shutil.which, NOTIFIERS)):
            raise SettingError(
                "--notify desktop: this machine has none of {programs}; expected one, or another address.",
                programs=", ".join(NOTIFIERS),
            )
        is_web = urlsplit(text).scheme in ("http", "https") and urlsplit(text).hostname
        is_mail = text.startswith(MAIL) and _MAIL_ADDRESS.fullmatch(text.removeprefix(MAIL))
        if not (text == DESKTOP or is_web or is_mail):
            raise SettingError(
                "--notify {text}: expected desktop, https://HOST/PATH or mailto:NAME@HOST.", text=text[:200]
            )
    return tuple(addresses)


@contextlib.contextmanager
def notified(
    callback: TrainingCallback, addresses: Sequence[str], on_message: Callable[[str], None]
) -> Iterator[TrainingCallback]:
    """Yield a callback that tells the addresses as well; an error that leaves the block is told, too.

    Args:
        callback: Who watches already.
        addresses: As of `--notify`; none: `callback` is yielded as it is.
        on_message: Called with a line where a message could not be sent.

    Raises:
        SettingError: As `require_addresses`.
    """
    if not addresses:
        yield callback
        return
    told = Notifications(require_addresses(addresses), on_message)
    try:
        yield Callbacks(callback, told)
    except BaseException as error:
        told.send("error", f"ended with an error: {error or type(error).__name__}")
        raise
    finally:
        told.close()


class Notifications:
    """Sends messages in a thread of its own: a training waits for nobody.

    Args:
        addresses: That `require_addresses` returned.
        on_message: Called with a line where a message could not be sent.
    """

    def __init__(self, addresses: Sequence[str], on_message: Callable[[str], None]) -> None:
        self._addresses, self._on_message = addresses, on_message
        self._sender = ThreadPoolExecutor(1, "racecraft-notify")
        self._run, self._title = "", ""
        self._has_lapped, self._told_record = False, -RECORD_SECONDS

    def run_made(self, path: Path) -> None:
        """Note where the run lies."""
        self._run = str(path)

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Note what is trained."""
        self._title = title

    def iteration(self, report: IterationReport) -> None:
        """Tell a first lap, or a record."""
        result = report.result
        if result is None or not result.goal_reached:
            return
        what = result.headline or f"score {result.score:.4g}"
        if not self._has_lapped:
            self._has_lapped, self._told_record = True, time.monotonic()
            self.send("first", f"reaches its goal: {what}")
        elif report.is_best and time.monotonic() - self._told_record >= RECORD_SECONDS:
            self._told_record = time.monotonic()
            self.send("record", f"has a new record: {what}")

    def end(self, reason: str) -> None:
        """Tell that it is over, and why."""
        self.send("end", f"ended: {reason}")

    def send(self, event: str, text: str) -> None:
        """Send a message to every address.

        Args:
            event: first, record, error or end.
            text: What follows the name of the run.
        """
        name = Path(self._run).name or self._title or "racecraft"
        for address in self._addresses:
            self._sender.submit(self._send, address, event, f"{name} {text}")

    def close(self) -> None:
        """Wait until what was told is sent, or given up."""
        self._sender.shutdown(wait=True)

    def _send(self, address: str, event: str, text: str) -> None:
        try:
            if address == DESKTOP:
                _show(text)
            elif address.startswith(MAIL):
                _mail(address.removeprefix(MAIL), text)
            else:
                _post(address, {"event": event, "text": text, "content": text, "run": self._run, "title": self._title})
        except (OSError, ValueError, subprocess.SubprocessError, smtplib.SMTPException) as error:
            self._on_message(f"- no message to {_without_secret(address)}: {error}")


def _show(text: str) -> None:
    if shutil.which(NOTIFIERS[0]):
        command = [NOTIFIERS[0], "racecraft", text]
    else:
        command = [NOTIFIERS[1], "-e", f'display notification {json.dumps(text)} with title "racecraft"']
    subprocess.run(command, check=True, capture_output=True, timeout=SEND_SECONDS)


def _post(address: str, told: dict[str, str]) -> None:
    request = urllib.request.Request(address, json.dumps(told).encode(), {"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=SEND_SECONDS):
        pass


def _mail(to: str, text: str) -> None:
    server = urlsplit(os.environ.get(SMTP_VARIABLE) or "smtp://localhost")
    message = EmailMessage()
    message["Subject"], message["To"] = text.splitlines()[0][:200], to
    message["From"] = unquote(server.username) if "@" in unquote(server.username or "") else to  # type: ignore[arg-type]
    message.set_content(text)
    is_tls = server.scheme == "smtps"
    made = smtplib.SMTP_SSL if is_tls else smtplib.SMTP
    with made(server.hostname or "localhost", server.port or 0, timeout=SEND_SECONDS) as smtp:
        smtp.ehlo_or_helo_if_needed()
        if not is_tls and smtp.has_extn("starttls"):
            smtp.starttls()
        if server.username:
            smtp.login(unquote(server.username), unquote(server.password or ""))
        smtp.send_message(message)


def _without_secret(address: str) -> str:
    """Return an address without its path, which of a webhook is a password."""
    parts = urlsplit(address)
    return f"{parts.scheme}://{parts.hostname}/…" if parts.hostname else address
