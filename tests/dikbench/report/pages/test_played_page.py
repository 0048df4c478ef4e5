"""The page that one plays: what it shows under every control is what pandas says of the rows."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlencode

import numpy as np
import pandas as pd
import pytest
from makers.browser import BROWSER, DRIVER, browser_with
from makers.shared import made_once

from dikbench.metrics import Judgement, motion_of
from dikbench.report.contents.contents import gather
from dikbench.report.interactive.controls import controls
from dikbench.report.interactive.embedded import embed
from dikbench.report.interactive.page_rows import TOLERANCES_M, page_rows
from dikbench.report.pages.html_page import render_html
from dikbench.report.selection.categories import CATEGORIES
from dikbench.results.reading import read_results, without_attributes
from dikbench.robots.kinematics import Kinematics
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import run_study
from dikbench.statistics.success import counted, rates, succeeded, with_facts
from dikbench.study.study import load_study
from dikbench.viewer.recording import Recording, find_recording
from dikbench.viewer.viser_client import has_viser

pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
pytestmark = pytest.mark.skipif(
    not (BROWSER and DRIVER), reason="no chromium with its driver is installed"
)

STUDY: Final = """
description = "Small enough to be run by a test"
plants = ["ideal", "saturating"]
references = ["time", "path"]
seeds = [0]
scenarios = [
  "near-miss[robot=ur5,singularity=wrist,miss=0.02|0.2,speed=0.25|0.5]",
  "speed-sweep[robot=panda,speed=0.7|1.3]", "joint-limit-graze[robot=ur5]",
  "reach[robot=panda,duration=0.3]", "obstacle[robot=panda,where=hand]",
]
[[cells]]
formulations = ["pinv[after=scale]", "dls[damping=0.02|0.05|0.2]"]
[[cells]]
formulations = ["qp"]
solvers = ["daqp", "piqp", "daqp[interface=warm]"]
[timing]
reference = "dls"
scenarios = ["reach[robot=panda,duration=0.3]"]
problems = 5
rounds = 1
"""

PLAYS: Final = (
    "return !!document.querySelector('#charts svg') && document.getElementById('sample').value"
)


def ran(folder: Path) -> None:
    """Run the study, and make its page without figures."""
    (folder / "played.toml").write_text(STUDY)
    settings = RunSettings(jobs=1)
    run_study(load_study(str(folder / "played.toml")), folder / "out", settings, "a test")
    results = without_attributes(read_results(folder / "out"))
    page = render_html(gather(results, []), folder / "out", embed(results.trials))
    (folder / "out" / "report.html").write_text(page, encoding="utf-8")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the study, with its report."""
    return made_once(tmp_path_factory, "played", ran) / "out"


@pytest.fixture(scope="module")
def trials(results: Path) -> pd.DataFrame:
    """Its trials."""
    return without_attributes(read_results(results)).trials


@pytest.fixture(scope="module")
def rows(trials: pd.DataFrame) -> pd.DataFrame:
    """The rows of its page."""
    return page_rows(trials)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A browser with a profile of its own."""
    with browser_with(tmp_path_factory.mktemp("profile")) as driver:
        yield driver


@pytest.fixture
def page(browser: Any, results: Path) -> Any:
    """The page with its controls as at first, left open by another test where it was."""
    if browser.current_url.startswith("file") and "trial" not in browser.current_url:
        reset(browser)
        return browser
    return at(browser, results)


def at(browser: Any, results: Path, **state: str) -> Any:
    """Open the page in a state, and wait until it plays."""
    browser.get("about:blank")
    browser.get(f"{(results / 'report.html').as_uri()}{'#' if state else ''}{urlencode(state)}")
    wait(browser, PLAYS)
    if not state:
        browser.execute_script(
            "window.initially = Object.fromEntries(Array.from(document.querySelectorAll("
            "'#play select, #controls input'), (each) => [each.id, each.value]))"
        )
    return browser


def wait(browser: Any, script: str) -> Any:
    """Wait until a script returns what is true, and return that."""
    from selenium.webdriver.support.ui import WebDriverWait

    return WebDriverWait(browser, 120).until(lambda driver: driver.execute_script(script))


def choose(page: Any, **state: str) -> None:
    """Put controls to values as a hand would, and wait until the address says so."""
    page.execute_script(
        """
        for (const [name, value] of Object.entries(arguments[0])) {
          document.getElementById(name).value = value;
          document.getElementById(name).dispatchEvent(new Event("input", { bubbles: true }));
        }
        """,
        state,
    )
    wait(
        page,
        "const linked = new URLSearchParams(location.hash.slice(1)), wanted = "
        f"{json.dumps(state)}; return Object.entries(wanted).every(([name, value]) => "
        "linked.get(name) === value || (!linked.has(name) && initially[name] === value))",
    )


def reset(page: Any) -> None:
    """Put all controls back."""
    page.execute_script("location.hash.length > 1 && document.getElementById('reset').click()")
    wait(page, "return location.hash.length < 2")


def shown_ranking(page: Any) -> dict[str, tuple[float, int]]:
    """Success [%] and number of trials of each formulation in the ranking."""
    lines = page.execute_script(
        "return Array.from(document.querySelectorAll('#ranking tbody tr'),"
        " (row) => Array.from(row.cells, (cell) => cell.textContent))"
    )
    return {line[1]: (float(line[2]), int(line[6])) for line in lines}


def shown_marks(page: Any, view: str) -> list[dict[str, str]]:
    """What the marks of a view say of themselves, as read to those who do not see them."""
    texts = page.execute_script(
        'return Array.from(document.querySelectorAll(`#charts [class*="${arguments[0]}"]'
        " [aria-label*='; law: ']`), (mark) => mark.ariaLabel)",
        view,
    )
    return [dict(part.split(": ", 1) for part in text.split("; ")) for text in texts]


def chosen(rows: pd.DataFrame, **state: str) -> pd.DataFrame:
    """The rows that a state of the controls leaves, with `category` and `done`: by pandas."""
    values = {each.name: each.value for each in controls(rows)} | state
    found = rows
    if values["reference"] != "any":
        found = found[found["reference"].isin([values["reference"], "rest"])]
    for name in ("robot", "situation", "plant"):
        if values.get(name, "any") != "any":
            found = found[found[name].eq(values[name])]
    if values["rate"] != "any":
        found = found[found["deadline"] <= float(values["rate"])]
    if values.get("variant", "any") != "any":
        found = found[found["variant"].isin([values["variant"], "both"])]
    solver = values["solver"]
    if solver == "one each":
        found = found[found["first"].eq(1)]
    elif solver != "any":
        column = "interface" if solver in {"cold", "warm"} else "solver"
        found = found[found[column].eq(solver) | found["solver"].eq("none")]
    place = int(values["tolerance"]) + (7 if values["limits"] == "broken" else 0)
    category = found["outcomes"].str[place].astype(int)
    return found.assign(category=category, done=category.eq(0))


def expected(found: pd.DataFrame) -> dict[str, tuple[float, int]]:
    """Success [%] and number of trials of each formulation: means of means, level by level."""
    return {
        str(law): (
            100
            * part.groupby(["family", "robot", "scenario"])["done"].mean()
            .groupby(["family", "robot"]).mean().groupby("family").mean().mean(),
            len(part),
        )
        for law, part in found.groupby("law")
    }  # fmt: skip


STATES: Final = [
    *({"tolerance": str(k)} for k in range(1 + len(TOLERANCES_M))),
    {"limits": "broken"},
    {"limits": "broken", "tolerance": "6"},
    {"reference": "time"},
    {"reference": "any"},
    {"situation": "near singularities"},
    {"robot": "panda"},
    {"plant": "saturating"},
    {"plant": "any"},
    {"rate": "10000"},
    {"rate": "100"},
    {"variant": "any"},
    {"solver": "any"},
    {"solver": "warm"},
    {"solver": "cold", "variant": "any"},
    {"solver": "piqp"},
    {"versus": "qp, daqp"},
    {"most": "999", "variant": "any", "solver": "any", "plant": "any", "reference": "any"},
]
"""A state for every control, and some together."""


@pytest.mark.parametrize("state", STATES, ids=urlencode)
def test_ranking_and_matrix_are_what_pandas_says(
    page: Any, rows: pd.DataFrame, state: dict[str, str]
) -> None:
    """Whatever is chosen: rates, numbers of trials, and how many came to every outcome."""
    choose(page, **state)
    found = chosen(rows, **state)
    want = expected(found)
    got = shown_ranking(page)
    assert got.keys() == want.keys()
    for law, (rate, number) in want.items():
        assert got[law][0] == pytest.approx(rate, abs=0.0501), law
        assert got[law][1] == number, law
    marks = shown_marks(page, "matrix")
    counts: dict[Any, int] = found.groupby(["law", "situation", "category"]).size().to_dict()
    shares = {(law, where, CATEGORIES[each].name): n for (law, where, each), n in counts.items()}
    said = {
        (m["law"], m["situation"], m["outcome"]): int(m["trials"]) for m in marks if "share" in m
    }
    assert said == shares


def test_every_control_is_of_a_state(rows: pd.DataFrame) -> None:
    """No control of the page goes untested."""
    assert {each.name for each in controls(rows)} <= {name for state in STATES for name in state}


def test_rates_are_those_of_the_tables(trials: pd.DataFrame, rows: pd.DataFrame) -> None:
    """What the page weighs is what `statistics.success` weighs."""
    facts = with_facts(trials)
    part = counted(facts[facts["plant"].eq("ideal")], "path")
    found = rates(part, succeeded(part))
    wanted = dict(zip(found.contenders.itertuples(index=False, name=None), found.rate, strict=True))
    of_page = expected(chosen(rows, solver="any", variant="any"))
    laws = rows.drop_duplicates("law").set_index("law")[["formulation", "solver"]]
    for law, (rate, _) in of_page.items():
        assert rate == pytest.approx(100 * wanted[tuple(laws.loc[law])]), law


def test_outcomes_are_those_of_the_judgement(trials: pd.DataFrame, rows: pd.DataFrame) -> None:
    """At the scenario's own tolerance the stored outcome; success grows with the tolerance."""
    stored = trials.set_index("id")["outcome"]
    for trial, outcomes in zip(rows["id"], rows["outcomes"], strict=True):
        assert stored[trial] in CATEGORIES[int(outcomes[0])].outcomes
        kept = [int(digit == "0") for digit in outcomes[1:7]]
        assert kept == sorted(kept)
        assert all(a <= b for a, b in zip(kept, (int(d == "0") for d in outcomes[8:]), strict=True))
    one: Any = trials[trials["id"].eq(rows["id"].iloc[0])].to_dict("records")[0]
    at_2_mm = Judgement.of_row(one).at(0.002).outcome
    assert at_2_mm in CATEGORIES[int(rows["outcomes"].iloc[0][2])].outcomes


def test_a_control_moved_by_hand_changes_every_view(page: Any, rows: pd.DataFrame) -> None:
    """Ranking, matrix, cost, profile: all of them follow; the address holds the state."""
    views = ("matrix", "cost", "profile", "deadline")
    before = {view: said_by(page, view) for view in views}
    choose(page, robot="panda")
    assert shown_ranking(page).keys() == expected(chosen(rows, robot="panda")).keys()
    for view in views:
        assert said_by(page, view) != before[view], view
    assert "robot=panda" in page.current_url
    reset(page)
    assert said_by(page, "matrix") == before["matrix"]


def said_by(page: Any, view: str) -> list[str]:
    """What the marks of a view say, whatever their order."""
    return sorted(map(str, shown_marks(page, view)))


def test_costs_are_medians_of_the_successes(page: Any, rows: pd.DataFrame) -> None:
    """Distance and slow-down of the points; relative to a law over the cases that both did."""
    found = chosen(rows)
    done = found[found["done"] & found["slow"].notna()]
    marks = {m["law"]: m for m in shown_marks(page, "cost")}
    assert marks
    for law, mark in marks.items():
        part = done[done["law"].eq(law)]
        assert float(mark["trials"]) == len(part)
        assert number_of(mark, "slow-down") == pytest.approx(part["slow"].median(), rel=5e-3)
        assert number_of(mark, "rms distance") == pytest.approx(part["error"].median(), rel=5e-3)
    choose(page, versus="qp, daqp")
    cases = ["scenario", "seed", "plant", "reference"]
    rival = done[done["law"].eq("qp, daqp")].set_index(cases)
    for mark in shown_marks(page, "cost"):
        part = done[done["law"].eq(mark["law"])].set_index(cases)
        ratio = (part["error"] / rival["error"]).dropna()
        assert float(mark["trials"]) == len(ratio)
        assert number_of(mark, "rms distance") == pytest.approx(ratio.median(), rel=6e-3)


def number_of(mark: dict[str, str], words: str) -> float:
    """The number that a mark says under a title with these words."""
    [text] = [value for key, value in mark.items() if key.startswith(words)]
    return float(text)


PHASE_TEXTS: Final = (
    "return Array.from(document.querySelectorAll('#charts [class*=phase_layer_1] text'),"
    " (text) => text.textContent)"
)


def test_phase_diagram_shows_what_is_chosen(page: Any, rows: pd.DataFrame) -> None:
    """Success, distance and peak speed of one formulation over distance and speed."""
    found = chosen(rows)
    choose(page, phase="qp, daqp")
    part = found[found["law"].eq("qp, daqp") & found["grid"].ne("")]
    assert len(part) == 4
    texts = page.execute_script(PHASE_TEXTS)
    want = part.groupby(["across", "up"])["done"].agg(["mean", "size"])
    assert sorted(texts) == sorted(f"{100 * m:.0f}% of {n:g}" for m, n in want.to_numpy())
    choose(page, quantity="peak")
    peaks = [float(text) for text in page.execute_script(PHASE_TEXTS)]
    assert np.sort(peaks) == pytest.approx(
        np.sort(part.groupby(["across", "up"])["peak"].max()), rel=5e-3
    )


def test_nothing_goes_wrong_and_nothing_is_asked_for(browser: Any, results: Path) -> None:
    """No error in the console and no request but for the page, controls moved and a trial open."""
    browser.get("about:blank")
    browser.get_log("performance"), browser.get_log("browser")
    page = at(browser, results)
    choose(page, tolerance="3", rate="100", robot="ur5")
    opened_trial(page)
    events = [json.loads(each["message"])["message"] for each in page.get_log("performance")]
    asked = [
        event["params"]["request"]["url"]
        for event in events
        if event["method"] == "Network.requestWillBeSent"
    ]
    outside = [url for url in asked if not url.startswith(("data:", "blob:", "about:"))]
    assert {url.partition("#")[0] for url in outside} <= {(results / "report.html").as_uri()}
    errors = [each for each in page.get_log("browser") if each["level"] == "SEVERE"]
    assert errors == []


def test_nobody_is_ranked_over_few_scenarios(page: Any) -> None:
    """A view of fewer than five scenarios names no first, and one without trials says so."""
    choose(page, robot="panda", situation="beyond joint speed")
    assert "Nobody is ranked" in page.find_element("id", "leading").text
    places = page.execute_script(
        "return Array.from(document.querySelectorAll('#ranking tbody tr'),"
        " (row) => row.cells[0].textContent)"
    )
    assert set(places) == {""}
    choose(page, robot="panda", situation="at joint limits")
    assert "No trial is left" in page.find_element("id", "leading").text


def opened_trial(page: Any) -> str:
    """Click on a bar of the matrix, then on the first trial that the page carries; its id."""
    page.execute_script(
        """
        const bar = document.querySelector('#charts [class*="matrix"] [aria-label*="outcome"]');
        const { x, y } = bar.getBoundingClientRect();
        const at = { bubbles: true, clientX: x + 2, clientY: y + 2 };
        for (const type of ["pointerdown", "mousedown", "pointerup", "mouseup", "click"])
          bar.dispatchEvent(new MouseEvent(type, at));
        """
    )
    wait(page, "return !document.getElementById('trials').hidden")
    trial = page.execute_script(
        """
        const row = Array.from(document.querySelectorAll("#trials tbody tr"))
          .find((row) => row.cells[8].textContent);
        row.querySelector("button").click();
        return row.querySelector("button").textContent;
        """
    )
    wait(
        page,
        "return !document.getElementById('run').hidden && document.getElementById('clock').value",
    )
    return str(trial)


def test_a_bar_leads_to_its_trials_and_a_trial_to_its_run(
    page: Any, rows: pd.DataFrame, results: Path
) -> None:
    """The run is one of the bar's, told by its commands, certificate and time, and it moves."""
    first = shown_marks(page, "matrix")[0]
    trial = opened_trial(page)
    row = rows.set_index("id").loc[trial]
    assert (row["law"], row["situation"]) == (first["law"], first["situation"])
    title, commands = (page.find_element("id", name).text for name in ("run-title", "run-commands"))
    assert row["scenario"] in title
    assert row["law"] in title
    assert f"dikbench replay {trial}" in commands
    assert f"--formulation '{row['formulation']}'" in commands
    assert f"trial={trial}" in page.current_url
    recording = find_recording(trial, results)
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
slider.value = share;
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


def test_a_link_restores_a_trial_beside_another(browser: Any, results: Path) -> None:
    """The address holds the trial, what is beside it, and the controls."""
    page = at(browser, results)
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
    again = at(browser, results, trial=trial, beside=beside, tolerance="2")
    wait(again, "return !document.getElementById('run').hidden")
    wait(again, "return document.querySelectorAll('#replays > div:not([hidden])').length == 2")
    assert again.execute_script("return document.getElementById('beside').value") == beside
    assert again.execute_script("return document.getElementById('tolerance').value") == "2"
