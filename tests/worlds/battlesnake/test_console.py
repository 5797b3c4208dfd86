"""A trained snake plays a game from its page in the console, and the game is shown on its board."""

import json

import pytest
from tests.browser import Browser, needs_chromium
from tests.console.conftest import working_console  # noqa: F401

import racecraft as rc
from racecraft.console.parts import parts_of
from racecraft.formats.run_folder import RunFolder


def test_a_clone_has_the_board_and_rules_of_its_model(tmp_path):
    game = {"width": 7, "players": 3, "ruleset": "wrapped"}
    job = {"format": "racecraft run", "version": 1, "algorithm": "dqn", "asked": {"game": game}}
    (tmp_path / "job.json").write_text(json.dumps(job))
    parts = parts_of("battlesnake")
    words = parts.words(parts.values_of(RunFolder(tmp_path)))
    assert words[:6] == ["snakes", "train", "--size=7", "--snakes=3", "--ruleset=wrapped", "--algorithm=dqn"]


def test_a_game_goes_by_the_rules_of_the_training_and_is_numbered_on(tmp_path):
    game = {"width": 7, "height": 9, "players": 3, "ruleset": "wrapped", "map": "empty"}
    (tmp_path / "job.json").write_text(json.dumps({"format": "racecraft run", "version": 1, "asked": {"game": game}}))
    (tmp_path / "game-9.jsonl").touch()
    (tmp_path / "game-over.jsonl").touch()
    _, words = parts_of("battlesnake").tab_task({"run": str(tmp_path), "name": "viper"}, "games")
    assert words == [
        "snakes", "play", str(tmp_path), "area_control", "area_control", "--width=7", "--height=9",
        "--gametype=wrapped", "--map=empty", "--name=viper", f"--output={tmp_path}/game-10.jsonl",
    ]  # fmt: skip


@needs_chromium
@pytest.mark.long  # a training and a game, each in a process of its own
def test_a_game_is_played_listed_and_shown(working_console):  # noqa: F811
    address, console, _ = working_console
    run = console.workspace.path / "runs/viper"
    rc.train(
        "battlesnake", size=7, snakes=2, run=run, quiet=True, stops="iterations=1",
        settings={"rollout.horizon": 8, "evaluation.episodes": 1},
    )  # fmt: skip
    console.watcher.refresh()
    browser = Browser(1280, 800)
    browser.bypass_policy()
    page = browser.page
    try:
        browser.open(f"{address}/models/viper/games")
        page.click("button:has-text('Play a game')")
        page.wait_for_selector("text=Game 1", timeout=120_000)
        assert (run / "game-1.jsonl").is_file()
        assert browser.shut_out() == []
        browser.show(390, 844, dark=True)
        assert browser.sideways() == 0
        assert browser.shut_out() == []
        page.click("text=Game 1")
        page.wait_for_selector("text=area_control")
        assert browser.complaints == []
    finally:
        browser.close()
