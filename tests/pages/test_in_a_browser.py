"""The page with every part, in a real browser: read by everybody, on a phone too; charts answer hand and keyboard."""

import pytest
from tests.browser import Browser, needs_chromium

from racecraft.pages.chart import Chart, Series
from racecraft.pages.every_part import every_part
from racecraft.pages.parts import card, chart, heading, page
from racecraft.pages.render import render_file

pytestmark = needs_chromium
CHART = "document.querySelector('rc-chart')"


@pytest.fixture(scope="module")
def browser():
    one = Browser()
    yield one
    assert one.complaints == []
    one.close()


STRETCH = """(() => {
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), texts = [];
  while (walk.nextNode()) texts.push(walk.currentNode);
  const words = texts.filter(one => !one.parentElement.closest("script, style, svg"));
  for (const one of words) one.data = one.data.replace(/[aeiou]/g, "$&ë");
})()"""
"""Makes every word of a page longer, as those of other languages are."""


def test_every_part_is_read_by_everybody(browser, tmp_path):
    (tmp_path / "parts.html").write_text(render_file("every_part.html", **every_part()), encoding="utf-8")
    for width in (1440, 390):
        for dark in (False, True):
            browser.show(width, 900, dark)
            browser.open((tmp_path / "parts.html").as_uri())
            browser.until(f"{CHART}.plot")
            assert browser.shut_out() == []
            browser.value(STRETCH)
            assert browser.sideways() == 0
    browser.value("document.querySelector('button').textContent = ''")
    assert [rule for rule, _ in browser.shut_out()] == ["button-name"], "the test can fail"


ON_PAPER = """(() => {
  const all = name => [...document.querySelectorAll(name)].filter(one => one.checkVisibility());
  const right = one => one.getBoundingClientRect().right;
  return {
    ground: getComputedStyle(document.body).backgroundColor,
    axis: document.querySelector("rc-chart").plot.axes[0].stroke(),
    seen: all(".bar-side, .tabs, .toast, .hint, main button:not(.key *), details:not([open]), #small-print").length,
    wide: all("canvas, table").filter(one => right(one) > right(one.closest(".card"))).length,
    cut: all(".scroll, pre").filter(one => one.scrollHeight > one.clientHeight + 1).length,
  };
})()"""


def test_on_paper_every_part_is_light_and_whole_without_what_is_for_a_hand(browser, tmp_path):
    (tmp_path / "parts.html").write_text(render_file("every_part.html", **every_part()), encoding="utf-8")
    browser.show(1440, 900, dark=True)
    browser.open((tmp_path / "parts.html").as_uri())
    browser.until(f"{CHART}.plot")
    browser.value("document.querySelectorAll('rc-chart details').forEach(one => { one.open = true; })")
    browser.page.emulate_media(media="print")
    browser.show(718)
    found = browser.value(ON_PAPER)
    browser.page.emulate_media(media="screen")
    assert found == {"ground": "rgb(255, 255, 255)", "axis": "#5c6770", "seen": 0, "wide": 0, "cut": 0}


def test_a_chart_answers_hand_and_keyboard(browser, tmp_path):
    x = list(range(100))
    lines = [Series("a", x, [k % 7 for k in x]), Series("b", [0, 50, 50], [1, 2, 3], "dots")]
    shown = page("A chart", [heading("One"), card(chart(Chart("t", "lap", "s", lines, smooth=True)))])
    (tmp_path / "chart.html").write_text(shown, encoding="utf-8")
    browser.show(1200, 900)
    browser.open((tmp_path / "chart.html").as_uri())
    browser.until(f"{CHART}.plot")
    assert browser.value(f"{CHART}.columns[2].filter(y => y != null)") == [1, 2, 3], "two values at one place are kept"
    browser.click("rc-chart .plot")
    browser.press("Home")
    browser.press("ArrowRight")
    assert "lap 1" in browser.value(f"{CHART}.place.getAttribute('aria-valuetext')")
    browser.press("+")
    assert browser.value(f"{CHART}.plot.scales.x.max") < 99
    browser.press("Escape")
    assert browser.value(f"{CHART}.plot.scales.x.max") == 99
    browser.value(f"(s => {{ s.value = 0.9; s.oninput(); }})({CHART}.querySelector('input'))")
    assert browser.value(f"{CHART}.columns.length") == 4, "the true values stay"
    browser.click("rc-chart .key button")
    assert browser.value(f"{CHART}.plot.series[1].show") is False
    before = browser.value(f"{CHART}.plot.series[3].stroke()")
    browser.show(1200, 900, dark=True)
    browser.until(f"{CHART}.plot.series[3].stroke() !== '{before}'")  # its colours are the page's
