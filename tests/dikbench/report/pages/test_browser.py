"""The report in a browser as readers have it: offline, by keyboard, without scripts, at night."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from makers.browser import BROWSER, DRIVER
from makers.rows import make_rows, write_results

from dikbench.report.write import write_report

pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

pytestmark = pytest.mark.skipif(
    not (BROWSER and DRIVER), reason="no chromium with its driver is installed"
)

ERRORS = {
    "formulation 1": 9.0,
    "formulation 2": 0.1,
    "formulation 3": 1e-5,
    "formulation 4": 100.0,
    "formulation 5": 20.0,
}
"""Distances from the path [m] whose order as texts is another than as numbers."""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report on five formulations, one of which failed, by its file."""
    formulations: dict[Any, Any] = {
        name: {"contour_error_6d_max_m": [error, error * 1.1], "formulation_time_median_us": error}
        for name, error in ERRORS.items()
    }
    formulations["formulation 4"] |= {"timing_stability": "drift"}
    formulations["qp", "daqp"] = {
        "status": "timeout",
        "claimed_share": 1.0,
    }
    folder = tmp_path_factory.mktemp("report") / "out"
    write_results(folder, make_rows(formulations, ("reach", "near-miss[miss=0.02]"), seeds=(0, 1)))
    write_report(folder)
    return folder / "report.html"


@pytest.fixture
def page(browser: Any, report: Path) -> Iterator[Any]:
    """The browser with the report just opened."""
    browser.get(report.as_uri())
    yield browser
    for command, arguments in (
        ("Emulation.setScriptExecutionDisabled", {"value": False}),
        ("Emulation.setEmulatedMedia", {"media": "", "features": []}),
        ("Emulation.clearDeviceMetricsOverride", {}),
    ):
        browser.execute_cdp_cmd(command, arguments)


def table(page: Any) -> Any:
    """The first table of the tracking error."""
    return page.find_element(By.CSS_SELECTOR, "table:has(#overall-tracking_error-1)")


def formulations(page: Any) -> list[str]:
    """The laws of the first table in their order on the page, those that are hidden left out."""
    rows = table(page).find_elements(By.CSS_SELECTOR, "tbody tr:not([hidden]) th")
    return [row.text for row in rows]


def heading(page: Any, words: str) -> Any:
    """The heading of a column of the first table."""
    found = table(page).find_elements(By.TAG_NAME, "th")
    return next(cell for cell in found if cell.text.startswith(words))


def sorted_by(page: Any, words: str, direction: str) -> list[str]:
    """The order of the formulations, once a column says that it is sorted so."""
    wait = WebDriverWait(page, 10)
    wait.until(lambda page: heading(page, words).get_attribute("aria-sort") == direction)
    page.execute_async_script("setTimeout(arguments[0], 30)")  # sorting follows the click
    return formulations(page)


def test_columns_are_sorted_by_number_both_ways(page: Any) -> None:
    """1e-05 comes before 0.1, and 20 before 100; a failed formulation is infinitely far."""
    button = heading(page, "off the path median").find_element(By.TAG_NAME, "button")
    assert heading(page, "off the path median").get_attribute("aria-sort") is None
    button.click()
    smallest_first = sorted(ERRORS, key=ERRORS.__getitem__)
    assert sorted_by(page, "off the path median", "ascending") == [*smallest_first, "qp"]
    heading(page, "off the path median").find_element(By.TAG_NAME, "button").click()
    assert sorted_by(page, "off the path median", "descending") == ["qp", *smallest_first[::-1]]


def test_columns_are_sorted_by_keyboard(page: Any) -> None:
    """Tab reaches the buttons; Enter and Space press them, and the focus stays."""
    button = heading(page, "formulation").find_element(By.TAG_NAME, "button")
    page.execute_script("arguments[0].focus()", button)
    page.switch_to.active_element.send_keys(Keys.TAB)
    assert page.switch_to.active_element.text.startswith("solver")
    page.switch_to.active_element.send_keys(Keys.SHIFT, Keys.TAB)
    page.switch_to.active_element.send_keys(Keys.ENTER)
    assert sorted_by(page, "formulation", "ascending") == [*sorted(ERRORS), "qp"]
    page.switch_to.active_element.send_keys(Keys.SPACE)
    assert sorted_by(page, "formulation", "descending") == ["qp", *sorted(ERRORS, reverse=True)]
    assert page.switch_to.active_element.text.startswith("formulation")


def test_only_one_column_says_that_it_is_sorted(page: Any) -> None:
    """Sorting by another column takes the mark from the first."""
    for words in ("formulation", "off the path median"):
        heading(page, words).find_element(By.TAG_NAME, "button").click()
        sorted_by(page, words, "ascending")
    assert len(table(page).find_elements(By.CSS_SELECTOR, "th[aria-sort]")) == 1


def test_rows_are_filtered_by_law_and_solver(page: Any) -> None:
    """Every word must occur; the number of rows is said; no word shows all again."""
    box = page.find_element(By.ID, "filter")
    box.send_keys("daqp QP")
    assert formulations(page) == ["qp"]
    assert " of " in page.find_element(By.ID, "rows-shown").text
    heading(page, "formulation").find_element(By.TAG_NAME, "button").click()
    assert sorted_by(page, "formulation", "ascending") == ["qp"]
    box.clear()
    box.send_keys(Keys.SPACE)
    assert len(formulations(page)) == len(ERRORS) + 1
    assert page.find_element(By.ID, "rows-shown").text == ""


def test_nothing_is_asked_of_the_network_and_nothing_goes_wrong(browser: Any, report: Path) -> None:
    """The only request is for the page itself, and the console stays empty."""
    browser.get("about:blank")
    browser.get_log("performance")
    browser.get_log("browser")
    browser.get(report.as_uri())
    events = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [
        event["params"]["request"]["url"]
        for event in events
        if event["method"] == "Network.requestWillBeSent"
    ]
    assert [url for url in asked if not url.startswith("data:")] == [report.as_uri()]
    assert browser.get_log("browser") == []
    assert browser.execute_script("return performance.getEntriesByType('resource').length") == 0


def test_figures_are_drawn(page: Any) -> None:
    """Each inlined figure has a size of its own: it was read as a picture."""
    sizes = page.execute_script(
        "return Array.from(document.images, (image) => image.complete && image.naturalWidth)"
    )
    assert len(sizes) > 0
    assert all(sizes)


def test_all_of_it_is_there_without_scripts(browser: Any, report: Path) -> None:
    """Rows, sentences and figures are in the page; what would do nothing is not."""
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        browser.get(report.as_uri())
        assert formulations(browser) == [*ERRORS, "qp"]
        assert browser.find_elements(By.CSS_SELECTOR, "th button") == []
        assert not browser.find_element(By.ID, "filter").is_displayed()
        assert browser.find_element(By.CSS_SELECTOR, ".findings dd").text
        summary = browser.find_element(By.CSS_SELECTOR, "#families summary")
        summary.click()
        assert browser.find_element(By.CSS_SELECTOR, "#families h4").is_displayed()
    finally:
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_can_be_read_in_the_light_and_in_the_dark(page: Any, scheme: str) -> None:
    """Every text has a contrast of at least 4.5 to its ground; figures keep a white plate."""
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    colours = page.execute_script(
        """
        const ground = (element) => {
          for (let at = element; at; at = at.parentElement) {
            const colour = getComputedStyle(at).backgroundColor;
            if (!colour.endsWith(", 0)")) return colour;
          }
          return "rgb(255, 255, 255)";
        };
        const texts = "p, dt, dd, td, th, a, summary, code, pre, .quiet, small";
        const of = (e) => [getComputedStyle(e).color, ground(e), e.outerHTML];
        return Array.from(document.querySelectorAll(texts), of);
        """
    )
    assert len(colours) > 100
    for ink, ground, what in colours:
        light, dark = sorted((luminance(ink), luminance(ground)), reverse=True)
        assert (light + 0.05) / (dark + 0.05) >= 4.5, what
    body = page.execute_script("return getComputedStyle(document.body).backgroundColor")
    assert (luminance(body) < 0.05) == (scheme == "dark")
    plate = page.execute_script("return getComputedStyle(document.images[0]).backgroundColor")
    assert luminance(plate) > 0.99


def luminance(colour: str) -> float:
    """Relative luminance of `rgb(r, g, b)` (WCAG 2)."""
    parts = [float(part) / 255 for part in colour[colour.index("(") + 1 : -1].split(",")[:3]]
    linear = [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_a_narrow_screen_scrolls_the_tables_and_not_the_page(page: Any) -> None:
    """At 320 pixels the page is as wide as the screen; a table scrolls within itself."""
    size = {"width": 320, "height": 700, "deviceScaleFactor": 1, "mobile": False}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    assert page.execute_script("return document.documentElement.scrollWidth") <= 320
    scrolls = (
        "const box = arguments[0].closest('.scroll'); return box.scrollWidth > box.clientWidth"
    )
    assert page.execute_script(scrolls, table(page))


def test_the_first_tab_skips_to_the_summary(page: Any) -> None:
    """A skip link comes first, is seen once it has the focus, and leads to the summary."""
    page.find_element(By.TAG_NAME, "body").send_keys(Keys.TAB)
    link = page.switch_to.active_element
    assert link.text.startswith("Skip to")
    assert link.rect["x"] >= 0
    outline = page.execute_script("return getComputedStyle(arguments[0]).outlineStyle", link)
    assert outline == "solid"
    link.send_keys(Keys.ENTER)
    assert page.current_url.endswith("#summary")


def test_it_prints(page: Any) -> None:
    """Printing gives a few pages, without the bar of links and the filter."""
    printed = page.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
    assert len(printed["data"]) > 10_000
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert not page.find_element(By.CSS_SELECTOR, "nav").is_displayed()
