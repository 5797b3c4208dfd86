"""Messages of a training: to a webhook and a mail server of the test's own, and a program that shows them."""

import http.server
import json
import socketserver
import threading

import pytest

import racecraft as rc
from racecraft.contract.errors import SettingError
from racecraft.training.callbacks import EvaluationResult, IterationReport, NullCallback
from racecraft.training.notify import notified, require_addresses


class Webhook(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        self.server.told.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_):
        pass


class MailServer(socketserver.StreamRequestHandler):
    def handle(self):
        self.wfile.write(b"220 here\r\n")
        in_letter = False
        for line in self.rfile:
            if in_letter:
                self.server.told.append(line.decode().rstrip())
                in_letter = line != b".\r\n"
                if not in_letter:
                    self.wfile.write(b"250 taken\r\n")
                continue
            in_letter = line.upper().startswith(b"DATA")
            quits = line.upper().startswith(b"QUIT")
            self.wfile.write(b"354 go on\r\n" if in_letter else b"221 bye\r\n" if quits else b"250 well\r\n")


def served(kind, handler):
    made = kind(("127.0.0.1", 0), handler)
    made.told = []
    threading.Thread(target=made.serve_forever, args=(0.01,), daemon=True).start()
    return made


@pytest.fixture
def webhook():
    made = served(http.server.HTTPServer, Webhook)
    yield made
    made.shutdown()
    made.server_close()


def address(server):
    return f"http://127.0.0.1:{server.server_address[1]}/secret"


def report(iteration, lap, is_best=True):
    result = EvaluationResult(100.0, True, goal_reached=lap is not None, headline=f"best lap {lap} s")
    return IterationReport(iteration, 1, 1.0, 1.0, 1, 1.0, 1.0, {}, result, is_best)


def test_a_training_tells_its_end_to_a_webhook(webhook, tmp_path):
    rc.train(
        "gymnasium", environment="CartPole-v1", run=tmp_path / "pole", stops="iterations=1", quiet=True,
        settings={"rollout.horizon": 16, "evaluation.episodes": 1}, notify=(address(webhook),),
    )  # fmt: skip
    assert [(one["event"], one["run"]) for one in webhook.told] == [("end", str(tmp_path / "pole"))]
    assert webhook.told[0]["text"].startswith("pole ended: ")


def test_the_first_lap_and_a_record_are_told_and_not_each_evaluation(webhook, monkeypatch):
    now = [0.0]
    monkeypatch.setattr("racecraft.training.notify.time.monotonic", lambda: now[0])
    with notified(NullCallback(), [address(webhook)], print) as told:
        for number, lap, seconds in ((1, None, 1), (2, 9.0, 2), (3, 8.9, 3), (4, 8.5, 90)):
            now[0] = seconds
            told.iteration(report(number, lap))
        now[0] = 300
        told.iteration(report(5, 8.6, is_best=False))
    assert [(one["event"], one["text"][-10:]) for one in webhook.told] == [
        ("first", " lap 9.0 s"), ("record", " lap 8.5 s"),
    ]  # fmt: skip


def test_an_error_is_told_and_raised(webhook):
    with pytest.raises(ZeroDivisionError), notified(NullCallback(), [address(webhook)], print):
        raise ZeroDivisionError("by nothing")
    assert [(one["event"], one["text"]) for one in webhook.told] == [
        ("error", "racecraft ended with an error: by nothing")
    ]


def test_a_message_goes_by_mail_and_to_the_desktop(tmp_path, monkeypatch):
    server = served(socketserver.ThreadingTCPServer, MailServer)
    monkeypatch.setenv("RACECRAFT_SMTP", f"smtp://127.0.0.1:{server.server_address[1]}")
    shown = tmp_path / "shown"
    (tmp_path / "notify-send").write_text(f'#!/bin/sh\necho "$2" >> {shown}\n')
    (tmp_path / "notify-send").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    said = []
    with notified(NullCallback(), ["mailto:me@example.org", "desktop"], said.append) as told:
        told.end("laps")
    server.shutdown()
    server.server_close()
    assert said == []
    assert {"Subject: racecraft ended: laps", "To: me@example.org"} <= set(server.told)
    assert shown.read_text() == "racecraft ended: laps\n"


def test_who_cannot_be_reached_is_said_without_the_secret_and_nothing_ends():
    said = []
    with notified(NullCallback(), ["http://127.0.0.1:9/secret"], said.append) as told:
        told.end("laps")
    assert len(said) == 1
    assert said[0].startswith("- no message to http://127.0.0.1/…: ")


@pytest.mark.parametrize("text", ["", "ftp://host/x", "mailto:nobody"])
def test_what_is_no_address_is_refused(text):
    with pytest.raises(SettingError, match="expected desktop, https://"):
        require_addresses([text])
