"""A Chromium of one's own, with 3D graphics in software, for tests of pages."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

BROWSER: Final = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)
DRIVER: Final = shutil.which("chromedriver") or ""

OPTIONS: Final = (
    "--headless",
    "--no-sandbox",  # the tests may be run by root
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--window-size=1280,900",
)

LONGEST_WAIT_S: Final = 120
"""Longest wait for a page: graphics in software take half a minute on a machine under load."""


@contextmanager
def browser_with(profile: Path) -> Iterator[Any]:
    """Start a browser (a webdriver) that keeps its profile in a folder, and end it afterwards."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    for option in (*OPTIONS, f"--user-data-dir={profile}"):
        options.add_argument(option)
    options.binary_location = BROWSER
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    driver.set_script_timeout(LONGEST_WAIT_S)
    try:
        yield driver
    finally:
        driver.quit()
