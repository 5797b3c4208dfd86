"""The whole way as a new user goes it: the command, one click, a car that laps, in a real browser."""

import os
import re
import subprocess
import sys

import pytest
from tests.browser import Browser, needs_chromium


@needs_chromium
@pytest.mark.long
def test_one_click_leads_to_a_car_that_laps(tmp_path):
    environment = {**os.environ, "RACECRAFT_JOBS": str(tmp_path / "jobs")}
    command = [sys.executable, "-m", "racecraft", "console", str(tmp_path / "here"), "--port", "0", "--no-open"]
    console = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
    browser = Browser(1440, 900)
    try:
        address = re.search(r"http://[\d.:]+", console.stdout.readline())[0]
        browser.open(address)
        browser.click("#train-first")
        # The page loads itself anew when the first map comes, which a selector outlives.
        browser.page.wait_for_selector("rc-cars:not([hidden])", state="attached", timeout=300_000)
        browser.page.wait_for_selector("[data-live=status]:has-text('Ready')", timeout=600_000)
        assert re.search(r"\d+\.\d\d s\s", browser.page.inner_text(".strip") + " ")
        browser.click("text=Laps")
        browser.page.wait_for_selector(".lap-map", timeout=60_000)
    finally:
        browser.close()
        console.terminate()
        console.wait()
        console.stdout.close()
