"""A club's season from beginning to end, each racer in a browser of their own: invited, entered, judged, champion."""

import io
import os
import re
import shutil
import subprocess
import sys
import zipfile
from contextlib import contextmanager

import pytest
from tests.browser import Browser, needs_chromium

from racecraft.formats.checkpoint import Checkpoints
from racecraft.worlds.deepracer.export.exporters import export_car
from racecraft.worlds.deepracer.logs import read

NAMES = ("Ann", "Ben", "Cho", "Dag", "Eva", "Fay")
PASSWORD = "a horse in the rain"
PATIENCE_MS = 300_000
ALL_JUDGED = """document.querySelectorAll(".board tbody tr").length === 6
    && !document.querySelector(".sentence").innerText.includes("wait")"""
RACECRAFT = (sys.executable, "-m", "racecraft")


@contextmanager
def console(folder):
    """A console that others reach, as its command starts it; yields the owner's address."""
    environment = {**os.environ, "RACECRAFT_JOBS": str(folder / "jobs")}
    command = [*RACECRAFT, "console", str(folder / "club"), "--host", "0.0.0.0", "--port", "0", "--no-open"]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
    try:
        yield re.search(r"http://[^\s;]+", process.stdout.readline())[0]
    finally:
        process.terminate()
        process.wait()
        process.stdout.close()


class Evening:
    """The club's people and their browsers.

    Args:
        browser: The owner's.
        address: Where the owner begins.
        look: Called with a name and a page at each step.
    """

    def __init__(self, browser, address, look=lambda name, page: None):
        self.browser, self.owner, self.look = browser, browser.page, look
        self.owner.set_default_timeout(PATIENCE_MS)
        self.root = re.match(r"http://[^/?]+", address)[0]
        self.owner.goto(address)
        self.pages = {}

    def invite(self):
        page = self.owner
        page.click("nav >> text=People")
        page.fill("#csv", "name,role\n" + "".join(f"{name},\n" for name in NAMES))
        page.click("#preview")
        self.look("preview", page)
        page.click("#invite-all")
        page.wait_for_selector("table.links")
        links = page.locator("table.links code").all_inner_texts()
        for name, link in zip(NAMES, links, strict=True):
            own = self.pages[name] = page.context.browser.new_context(
                viewport={"width": 1280, "height": 900}
            ).new_page()
            own.set_default_timeout(PATIENCE_MS)
            own.goto(link)
            own.fill("#password", PASSWORD)
            own.fill("#again", PASSWORD)
            own.click("button:has-text('Choose this password')")
            own.wait_for_selector("nav >> text=Races")
        self.look("first-page-of-a-racer", own)

    def bring_car(self, name, archive):
        page = self.pages[name]
        page.goto(f"{self.root}/import")
        page.set_input_files("#archive", archive)
        page.click("main button:has-text('Import')")
        page.wait_for_url(f"{self.root}/import/*")
        self.look(f"imported-{name}", page)

    def share_and_copy(self, name):
        page = self.owner
        page.goto(f"{self.root}/models")
        page.click(".models .name a:first-child")
        page.click("summary:has-text('Note')") if page.locator("#share").is_hidden() else None
        page.click("#share")
        page.wait_for_selector("text=Share no more")
        own = self.pages[name]
        own.goto(f"{self.root}/shared")
        self.look("shared", own)
        own.click("text=Take a copy")
        own.wait_for_url("**/models/**")

    def make_season(self):
        page = self.owner
        page.goto(f"{self.root}/races")
        page.click("text=New season")
        page.fill("#title", "Winter")
        page.fill("#points", "10,6,4,3,2,1")
        page.click("#create-race")
        page.wait_for_url("**/seasons/winter")
        page.goto(f"{self.root}/races/new")
        page.fill("#title", "Round one")
        page.select_option("#track", "Oval_track")
        page.fill("#laps", "2")
        page.select_option("#season", "winter")
        page.click("text=Show as command")
        assert "racecraft league create 'Round one' --track=Oval_track --laps=2 --season=winter" in page.inner_text(
            "main"
        )
        self.look("new-race", page)
        page.click("#create-race")
        page.wait_for_url("**/races/round-one")
        page.click("text=Copy")
        page.fill("#title", "Round two")
        page.click("#create-race")
        page.wait_for_url("**/races/round-two")

    def enter(self, name, race):
        page = self.pages[name]
        page.goto(f"{self.root}/races/{race}")
        page.click("text=Enter a model >> nth=0")
        self.look(f"enter-{name}", page)
        page.click("#enter")
        page.wait_for_url(f"**/races/{race}")

    def wait_until_judged(self, race):
        page = self.owner
        page.goto(f"{self.root}/races/{race}")
        self.look(f"board-moves-{race}", page)
        self.browser.until(ALL_JUDGED, PATIENCE_MS / 1000)
        self.look(f"board-{race}", page)
        page.click("button:has-text('Close')")
        page.wait_for_selector("text=Closed")

    def champion(self):
        page = self.pages["Ben"]
        page.goto(f"{self.root}/seasons/winter")
        self.look("season", page)
        return page.inner_text(".sentence"), [row.split("\t") for row in page.locator("tbody tr").all_inner_texts()]

    def what_cost(self, name, race):
        """Return what a racer reads of their own drive, and the files that they take along."""
        page = self.pages[name]
        page.goto(f"{self.root}/races/{race}")
        page.click("tr[aria-current] >> text=Watch")
        page.wait_for_selector(".lead .sentence")
        self.look("own-drive", page)
        with page.expect_download() as download:
            page.click("#files")
        return page.inner_text(".lead"), download.value.path().read_bytes()

    def film(self, name):
        page = self.pages[name]
        page.click("#film")
        page.wait_for_selector("video")
        self.look("film", page)


def trained_car(folder):
    """Train until the car laps; return its run, and archives of its last checkpoints, one older than the other."""
    command = [*RACECRAFT, "train", "--track=Oval_track", f"--run={folder}/oval", "--keep=all"]
    one_frame = "--set=network.stack_size=1"  # all that the software of a real car knows
    subprocess.run([*command, one_frame, "--stop=laps", "--stop=minutes=5"], check=True, capture_output=True)
    return folder / "oval"


def archives(run, folder):
    """Return archives of AWS's layout, one of each of the last checkpoints."""
    kept = [one.iteration for one in Checkpoints(run / "checkpoints").entries()][-5:]
    for name, which in zip(NAMES, kept, strict=False):
        export_car(run, "car", str(which), folder / f"{name}.tar.gz", False)
    return {name: folder / f"{name}.tar.gz" for name in NAMES[:5]}


def season(folder, run, look=lambda name, page: None):
    """Go through the whole evening."""
    (folder / "club/runs").mkdir(parents=True)
    shutil.copytree(run, folder / "club/runs/oval")
    brought = archives(run, folder)
    browser = Browser(1280, 900)
    try:
        with console(folder) as address:
            evening = Evening(browser, address, look)
            evening.invite()
            for name, archive in brought.items():
                evening.bring_car(name, archive)
            evening.share_and_copy("Fay")
            evening.make_season()
            for race in ("round-one", "round-two"):
                for name in NAMES:
                    evening.enter(name, race)
                evening.wait_until_judged(race)
            sentence, rows = evening.champion()
            assert re.search("is the champion with|are the champions with", sentence)  # cars much alike may share it
            assert sorted(row[1] for row in rows) == sorted(NAMES)
            assert int(rows[0][-2]) >= int(rows[-1][-2]) > 0
            words, packed = evening.what_cost(rows[-1][1], "round-two")
            assert re.search(r"turn \d|straight|No corner costs a tick", words), words  # of cars much alike
            with zipfile.ZipFile(io.BytesIO(packed)) as archive:
                archive.extractall(folder / "taken")
            assert len(read([folder / "taken"]).require_ticks())
            evening.film(rows[-1][1])
    finally:
        browser.close()


@needs_chromium
@pytest.mark.long
def test_six_racers_end_a_season_with_a_champion_and_one_finds_what_cost_the_time(tmp_path):
    season(tmp_path, trained_car(tmp_path))
