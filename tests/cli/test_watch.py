"""`racecraft watch` and `train --watch`, as a user types them."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path
from urllib.parse import urlsplit

import pytest

sys.path.append(str(Path(__file__).resolve().parents[1]))
from tests.cli.conftest import TINY  # noqa: E402
from tests.forked import Begun  # noqa: E402

from kept_run import make_run  # noqa: E402

RUN = [sys.executable, "-m", "racecraft"]
NO_BROWSER = {**os.environ, "BROWSER": "true"}


def told(url):
    with urllib.request.urlopen(url, timeout=60) as answer:
        return json.load(answer)


def once_up(url, enough=lambda answer: True):
    """Return what a page tells that is on its way, as soon as it is enough."""
    end = time.monotonic() + 60
    while True:
        try:
            if enough(answer := told(url)):
                return answer
        except OSError:
            pass
        assert time.monotonic() < end
        time.sleep(0.2)


def test_a_run_is_served_until_it_is_interrupted(tmp_path):
    make_run(tmp_path / "r", iterations=1, ticks=5)
    with Begun(["watch", "r", "--port", "0", "--json"], tmp_path, BROWSER="true") as served:
        said = json.loads(served.stdout.readline())
        assert told(said["url"] + "api/run")["name"] == "r"
        served.send_signal(signal.SIGINT)
        assert served.wait(60) == 0


def test_other_machines_need_the_token_of_the_address(tmp_path):
    make_run(tmp_path / "r", iterations=1, ticks=5)
    with Begun(["watch", "r", "--port", "0", "--host", "0.0.0.0", "--no-open", "--json"], tmp_path) as served:
        said = urlsplit(json.loads(served.stdout.readline())["url"])
        assert said.hostname == socket.gethostname().lower()
        here = f"http://127.0.0.1:{said.port}/"
        with pytest.raises(urllib.error.HTTPError, match="401") as refused:
            urllib.request.urlopen(f"{here}api/run", timeout=60)
        refused.value.close()
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        with browser.open(f"{here}?{said.query}", timeout=60) as page, browser.open(f"{here}api/run") as facts:
            assert page.url == here, "the token does not stay in the address"
            assert json.load(facts)["name"] == "r"


def test_what_is_no_run_is_named(racecraft):
    said = racecraft("watch", ".")
    assert (said.code, "holds no job.json" in said.err) == (2, True)


def test_a_training_opens_its_page_and_closes_it(tmp_path):
    command = ["train", "--watch", "--no-pictures", "--run", "r", "--json", *TINY, "--stop", "minutes=1"]
    with Begun(command, tmp_path, BROWSER="true") as training:
        line = next(line for line in training.stderr if line.startswith("watch: "))
        url = line.split()[1]
        once_up(url + "api/live?after=0", lambda answer: answer["reel"])
        training.send_signal(signal.SIGINT)
        training.communicate(timeout=60)
    with pytest.raises(OSError, match="refused"):
        told(url + "api/run")


@pytest.mark.skipif(os.name != "posix", reason="a terminal of its own is POSIX's")
def test_on_a_terminal_the_page_stays_until_ctrl_c(tmp_path):
    ours, theirs = os.openpty()
    command = [*RUN, "train", "--watch", "--no-pictures", "--run", "r", *TINY, "--stop", "iterations=1"]
    terminal = {"stdin": theirs, "stdout": theirs, "stderr": theirs}
    with subprocess.Popen(command, cwd=tmp_path, env=NO_BROWSER, **terminal) as training:
        os.close(theirs)
        try:
            said = b""
            while b"The page stays until Ctrl-C." not in said:
                said += os.read(ours, 4096)
            url = re.search(rb"watch: (http\S+/)", said)[1].decode()
            assert once_up(url + "api/run")["kind"] == "deepracer"
            training.send_signal(signal.SIGINT)
            assert training.wait(timeout=60) == 0
        finally:
            training.kill()
    os.close(ours)
    with pytest.raises(OSError, match="refused"):
        told(url + "api/run")
