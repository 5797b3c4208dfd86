"""A trained policy is put behind HTTP, asked and deleted, in a browser."""

import json

from tests.browser import Browser, needs_chromium

pytestmark = needs_chromium


def test_a_policy_is_deployed_asked_and_deleted(working_console):
    address, console, home = working_console
    browser = Browser(1440, 900)
    browser.bypass_policy()
    page = browser.page
    try:
        browser.open(f"{address}/endpoints?m=pole")
        assert browser.shut_out() == []
        page.click("button:has-text('Deploy')")
        page.wait_for_url("**/endpoints/pole-endpoint-1")
        page.wait_for_selector("#body", timeout=60_000)
        assert json.loads(page.input_value("#body")) == {"instances": [[0.0] * 4]}
        page.fill("#body", '{"instances": [[0.1, 0.0, 0.2, 0.0]]}')
        page.click("button:has-text('Ask')")
        page.wait_for_selector("#answer")
        assert json.loads(page.inner_text("#answer pre"))["predictions"][0]["actions"] in (0, 1)
        assert page.input_value("#body") == '{"instances": [[0.1, 0.0, 0.2, 0.0]]}'
        assert browser.shut_out() == []
        page.fill("#body", '{"instances": [[1, 2]]}')
        page.click("button:has-text('Ask')")
        page.wait_for_selector("#body[aria-invalid]")
        assert "expected (rows, 4)" in page.inner_text("#body-wrong")
        assert page.input_value("#body") == '{"instances": [[1, 2]]}'
        browser.show(390, 844, dark=True)
        assert browser.sideways() == 0
        assert browser.shut_out() == []
        page.click("button:has-text('Delete')")
        page.wait_for_url("**/endpoints")
        assert "No policy is behind HTTP" in page.inner_text("main")
        assert home.store().find("pole-endpoint-1") is None
    finally:
        browser.close()
