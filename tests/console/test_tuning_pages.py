"""A search for settings, from the form to a kept trial, in a browser; and the words it is begun with."""

import pytest
from starlette.requests import Request
from tests.browser import Browser, needs_chromium

from racecraft.actions.submit_job import submit_training
from racecraft.console.pages.tuning import form_page
from racecraft.console.tuning_form import SearchForm
from racecraft.contract.errors import SettingError
from racecraft.jobs.submit import wait
from racecraft.web.errors import WebError

TRAINED = ("train", ".", "--track=Oval_track", "--stop", "laps", "--stop=minutes=5", "--run", "runs/1")


def test_the_words_of_a_search_are_the_trainings_without_its_ends_and_place():
    form = SearchForm(
        model="m", chosen=("ppo.epochs",), ranges={"ppo.epochs": "2..8", "ppo.clip": "0.1..0.3"}, trials="12",
        more="race.reverse=true,false\n", minutes="1,5", parallel="2",
    )  # fmt: skip
    assert form.command(TRAINED) == [
        "--trials=12", "--parallel=2", "--param=ppo.epochs=2..8", "--param=race.reverse=true,false",
        "train", ".", "--track=Oval_track", "--stop=minutes=1.5",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"chosen": ()}, "Nothing is varied"),
        ({"more": "ppo.epochs=1,2"}, "varied twice"),
        ({"trials": "none"}, "Trials: found 'none'; expected a number from 1 to 1000"),
    ],
)
def test_what_cannot_be_used_is_said(changes, said):
    typed = {"model": "m", "chosen": ("ppo.epochs",), "ranges": {"ppo.epochs": "2..8"}, **changes}
    with pytest.raises(SettingError, match=said):
        SearchForm(**typed).command(TRAINED)


def test_the_form_without_a_model_says_where_one_is_chosen():
    with pytest.raises(WebError, match="choose one at /tuning"):
        form_page(None, Request({"type": "http", "query_string": b"", "headers": []}))


@needs_chromium
def test_a_search_is_begun_watched_and_its_best_trial_kept(working_console):
    address, console, home = working_console
    words = ["CartPole-v1", "--stop=iterations=2", "--set=rollout.horizon=16", "--set=evaluation.episodes=1"]
    job = submit_training(("gym", "train"), words, console.workspace.path / "runs/trained")
    wait(home, home.store(), job.name, 120)
    console.watcher.refresh()
    browser = Browser(1440, 900)
    browser.bypass_policy()
    page = browser.page
    try:
        browser.open(f"{address}/tuning")
        assert browser.shut_out() == []
        page.click("text=Choose what to vary")
        page.wait_for_url("**/tuning/new?m=trained")
        assert browser.shut_out() == []
        page.fill("#trials", "2")
        page.fill("#minutes", "none")
        page.click("text=Begin the search")
        page.wait_for_selector(".notice.bad")
        assert "Minutes of a trial: found 'none'" in page.inner_text(".notice.bad")
        assert page.input_value("#trials") == "2"
        page.fill("#minutes", "0,05")
        page.click("text=Begin the search")
        page.wait_for_url("**/tuning/1")
        page.wait_for_selector("text=Keep as a model", timeout=120_000)
        page.wait_for_selector(".pill:has-text('Completed')", timeout=120_000)
        page.wait_for_selector("text=is best of 2")
        assert "with ppo.learning_rate 0.0" in page.inner_text("p.sentence")
        page.wait_for_selector("button:has-text('Stop')", state="detached")
        assert browser.shut_out() == []
        browser.show(390, 844, dark=True)
        assert browser.sideways() == 0
        assert browser.shut_out() == []
        page.click("text=Keep as a model")
        page.wait_for_url("**/models/tuning-1-trial-*")
        assert [said for said in browser.complaints if "422" not in said] == []
    finally:
        browser.close()
    kept = [path.name for path in (console.workspace.path / "runs").iterdir() if path.name.startswith("tuning-1")]
    assert len(kept) == 1
    assert (console.workspace.path / "runs" / kept[0] / "job.json").is_file()
