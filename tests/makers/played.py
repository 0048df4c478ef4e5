"""A page to be played, of a study small enough to be run by a test, and what pandas says of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlencode

import pandas as pd

from dikbench.report.contents.contents import gather
from dikbench.report.interactive.controls import controls
from dikbench.report.interactive.embedded import embed
from dikbench.report.pages.html_page import render_html
from dikbench.results.reading import read_results, without_attributes
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import run_study
from dikbench.study.study import load_study
from makers.runs import without_workers

STUDY: Final = """
description = "Small enough to be run by a test"
plants = ["ideal", "saturating"]
references = ["time", "path"]
seeds = [0]
scenarios = [
  "near-miss[robot=ur5,singularity=wrist,miss=0.02|0.2,speed=0.25|0.5,dt=0.02]",
  "speed-sweep[robot=panda,speed=0.7|1.3,dt=0.02]", "joint-limit-graze[robot=ur5,dt=0.02]",
  "reach[robot=panda,duration=0.3]", "obstacle[robot=panda,where=hand,dt=0.02]",
]
[[cells]]
formulations = ["pinv[after=scale]", "dls[damping=0.02|0.05|0.2]"]
[[cells]]
formulations = ["pinv[after=clip]"]
scenarios = ["joint-limit-graze[robot=ur5,dt=0.02]"]
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
    with without_workers():
        study = load_study(str(folder / "played.toml"))
        run_study(study, folder / "out", RunSettings(jobs=1), "a test")
        results = without_attributes(read_results(folder / "out"))
        page = render_html(gather(results, []), folder / "out", embed(results.trials))
    (folder / "out" / "report.html").write_text(page, encoding="utf-8")


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
        " [aria-label*='; formulation: ']`), (mark) => mark.ariaLabel)",
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
        for law, part in found.groupby("contender")
    }  # fmt: skip


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
          .find((row) => row.cells[1].textContent);
        row.querySelector("button").click();
        return row.querySelector("button").textContent;
        """
    )
    wait(
        page,
        "return document.getElementById('run').className === 'carried'"
        " && document.getElementById('clock').value",
    )
    return str(trial)
