"""From a mark of the page to its trial: commands, traces, replay, links."""

from __future__ import annotations

import json
from pathlib import Path
from shlex import quote
from typing import Any, Final

import numpy as np
import pandas as pd
import pytest
from makers.browser import BROWSER, DRIVER
from makers.played import at, choose, opened_trial, shown_marks, wait

from dikbench.metrics import motion_of
from dikbench.robots.kinematics import Kinematics
from dikbench.viewer.recording import Recording, find_recording
from dikbench.viewer.viser_client import has_viser

pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
pytestmark = pytest.mark.skipif(
    not (BROWSER and DRIVER), reason="no chromium with its driver is installed"
)


def test_nothing_goes_wrong_and_nothing_is_asked_for(browser: Any, played: Path) -> None:
    """No error in the console and no request but for the page, controls moved and a trial open."""
    browser.get("about:blank")
    browser.get_log("performance"), browser.get_log("browser")
    page = at(browser, played)
    choose(page, tolerance="3", rate="100", robot="ur5")
    opened_trial(page)
    events = [json.loads(each["message"])["message"] for each in page.get_log("performance")]
    asked = [
        event["params"]["request"]["url"]
        for event in events
        if event["method"] == "Network.requestWillBeSent"
    ]
    outside = [url for url in asked if not url.startswith(("data:", "blob:", "about:"))]
    assert {url.partition("#")[0] for url in outside} <= {(played / "report.html").as_uri()}
    errors = [each for each in page.get_log("browser") if each["level"] == "SEVERE"]
    assert errors == []


def test_a_bar_leads_to_its_trials_and_a_trial_to_its_run(
    page: Any, rows: pd.DataFrame, played: Path
) -> None:
    """The run is one of the bar's, told by its commands, certificate and time, and it moves."""
    first = shown_marks(page, "matrix")[0]
    trial = opened_trial(page)
    row = rows.set_index("id").loc[trial]
    assert (row["contender"], row["situation"]) == (first["formulation"], first["situation"])
    title, commands = (page.find_element("id", name).text for name in ("run-title", "run-commands"))
    assert row["scenario"] in title
    assert row["contender"] in title
    assert f"dikbench replay {trial}" in commands
    assert f"--formulation {quote(str(row['formulation']))}" in commands
    assert f"trial={trial}" in page.current_url
    recording = find_recording(trial, played)
    told = page.execute_script("return document.getElementById('run-certificate').textContent")
    claims = recording.scenario.certificate.claims
    assert told.splitlines() == [str(claim) for claim in claims]
    # It opens at its worst instant.
    worst = int(np.argmax(motion_of(recording.trace, recording.scenario).tracking_error))
    clock = float(page.execute_script("return document.getElementById('clock').value").split()[0])
    assert clock == pytest.approx(worst * recording.trace.dt, abs=0.011 + recording.trace.dt)
    if has_viser():
        moves_as_the_trace_says(page, recording)


def moves_as_the_trace_says(page: Any, recording: Recording) -> None:
    """Check that at a time of the trace the tool stands where Pinocchio says."""
    ready = "document.querySelector('#replays iframe')?.contentWindow.__viserMutable"
    wait(page, f"return Boolean({ready})")
    trace, robot = recording.trace, recording.scenario.robot
    kinematics = Kinematics(robot)
    for k in (0, trace.steps // 3, trace.steps):
        tool = page.execute_async_script(TOOL_AT, k / trace.steps)
        kinematics.update(trace.q[k])
        want = kinematics.placement(robot.frame_id).homogeneous
        # The slider has steps of a thousandth of the time, and joints are rounded to 1e-4 rad.
        assert np.array(tool).reshape(4, 4).T == pytest.approx(want, abs=3e-3)


TOOL_AT: Final = """
const [share, done] = arguments, slider = document.getElementById("instant");
slider.value = share * slider.max;
slider.dispatchEvent(new Event("input"));
setTimeout(() => {
  const viser = document.querySelector("#replays iframe").contentWindow.__viserMutable;
  viser.scene.updateMatrixWorld(true);
  const name = Object.keys(viser.nodeRefFromName).find((each) => each.endsWith("/tool"));
  const base = viser.nodeRefFromName["/robot"].matrixWorld.clone().invert();
  done(base.multiply(viser.nodeRefFromName[name].matrixWorld).elements);
}, 1500);
"""
"""Moves the slider to a share of the time, and gives the pose of the tool in the robot's base."""


def test_a_link_restores_a_trial_beside_another(browser: Any, played: Path) -> None:
    """The address holds the trial, what is beside it, and the controls."""
    page = at(browser, played)
    trial = opened_trial(page)
    beside = page.execute_script(
        """
        const list = document.getElementById("beside");
        list.selectedIndex = 1;
        list.dispatchEvent(new Event("change"));
        return list.value;
        """
    )
    wait(page, f"return location.hash.includes('beside={beside}')")
    again = at(browser, played, trial=trial, beside=beside, tolerance="2")
    wait(again, "return document.getElementById('run').className === 'carried'")
    wait(again, "return document.querySelectorAll('#replays > div:not([hidden])').length == 2")
    assert again.execute_script("return document.getElementById('beside').value") == beside
    assert again.execute_script("return document.getElementById('tolerance').value") == "2"


def tab_to(page: Any, wanted: str, most: int = 60) -> list[str]:
    """Press Tab until an element that a selector finds has the focus; the ids passed by."""
    from selenium.webdriver.common.keys import Keys

    passed: list[str] = []
    for _ in range(most):
        page.switch_to.active_element.send_keys(Keys.TAB)
        if page.execute_script("return document.activeElement.matches(arguments[0])", wanted):
            return passed
        passed.append(page.execute_script("return document.activeElement.id"))
    raise AssertionError(f"{wanted} is not reached: {passed}")


def test_all_of_it_is_done_by_keyboard(browser: Any, played: Path) -> None:
    """Controls, a formulation of the ranking, a trial, another beside it, time; no frame traps."""
    from selenium.webdriver.common.keys import Keys

    page = at(browser, played)
    page.execute_script("document.getElementById('play-title').tabIndex = -1")
    page.execute_script("document.getElementById('play-title').focus()")
    controls = page.execute_script(
        "return Array.from(document.querySelectorAll('#controls :is(input, select):not([type="
        "hidden])'), (each) => each.id)"
    )
    assert page.execute_script("return document.activeElement.id") == "play-title"
    assert tab_to(page, "#reset") == controls
    page.execute_script("document.getElementById('tolerance').focus()")
    page.switch_to.active_element.send_keys(Keys.RIGHT)
    wait(page, "return location.hash.includes('tolerance=1')")
    assert page.execute_script("return document.getElementById('tolerance').ariaValueText")
    tab_to(page, "#reset")
    page.switch_to.active_element.send_keys(Keys.ENTER)
    wait(page, "return location.hash.length < 2")
    tab_to(page, "#ranking tbody button")
    name = page.switch_to.active_element.text
    page.switch_to.active_element.send_keys(Keys.ENTER)
    wait(page, "return document.activeElement.id === 'trials-title'")
    assert f"trials of {name}" in page.switch_to.active_element.text
    tab_to(page, "#all-trials")
    page.switch_to.active_element.send_keys(Keys.SPACE)
    # The first that is carried, whatever comes before it.
    carried = page.execute_script(
        "return Array.from(document.querySelectorAll('#trials-table tbody tr'))"
        ".findIndex((row) => row.cells[1].textContent) + 1"
    )
    tab_to(page, f"#trials-table tbody tr:nth-child({carried}) button")
    page.switch_to.active_element.send_keys(Keys.ENTER)
    wait(page, "return document.activeElement.id === 'run-title'")
    wait(page, "return document.getElementById('clock').value")
    tab_to(page, "#beside")
    page.switch_to.active_element.send_keys(Keys.DOWN)
    wait(page, "return location.hash.includes('beside=')")
    wait(page, "return document.querySelectorAll('#replays > div:not([hidden])').length == 2")
    if has_viser():
        frames = "document.querySelectorAll('#replays iframe')"
        wait(page, f"return {frames}.length == 2")
    assert tab_to(page, "#instant") == ["go"]  # no frame is between them
    page.switch_to.active_element.send_keys(Keys.HOME)
    assert page.execute_script("return document.getElementById('clock').value") == "0.00 s"
    page.switch_to.active_element.send_keys(Keys.RIGHT)
    assert page.execute_script("return Number(document.getElementById('instant').value)") > 0
    page.execute_script("document.getElementById('go').focus()")
    page.switch_to.active_element.send_keys(Keys.SPACE)
    end = "document.getElementById('instant').max"
    wait(page, f"return Number(document.getElementById('instant').value) >= 0.99 * {end}")
    wait(page, "return !document.getElementById('go').checked")
