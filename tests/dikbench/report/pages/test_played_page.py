"""The controls of the page: what it shows under each is what pandas says of the rows."""

from __future__ import annotations

from typing import Any, Final
from urllib.parse import urlencode

import numpy as np
import pandas as pd
import pytest
from makers.browser import BROWSER, DRIVER
from makers.played import choose, chosen, expected, reset, shown_marks, shown_ranking

from dikbench.report.interactive.controls import controls
from dikbench.report.interactive.page_rows import TOLERANCES_M
from dikbench.report.selection.categories import CATEGORIES
from dikbench.statistics.success import rates, succeeded, with_facts

pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
pytestmark = pytest.mark.skipif(
    not (BROWSER and DRIVER), reason="no chromium with its driver is installed"
)


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
    counts: dict[Any, int] = found.groupby(["contender", "situation", "category"]).size().to_dict()
    shares = {(law, where, CATEGORIES[each].name): n for (law, where, each), n in counts.items()}
    said = {
        (m["formulation"], m["situation"], m["outcome"]): int(m["trials"])
        for m in marks
        if "share" in m
    }
    assert said == shares


def test_every_control_is_of_a_state(rows: pd.DataFrame) -> None:
    """No control of the page goes untested."""
    assert {each.name for each in controls(rows)} <= {name for state in STATES for name in state}


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
    for state in ({"versus": "qp, daqp"}, {"variant": "any", "solver": "any"}, {"tolerance": "2"}):
        choose(page, **state)
    reset(page)
    for view in views:
        assert said_by(page, view) == before[view], view


def said_by(page: Any, view: str) -> list[str]:
    """What the marks of a view say, whatever their order."""
    return sorted(map(str, shown_marks(page, view)))


def test_costs_are_medians_of_the_successes(page: Any, rows: pd.DataFrame) -> None:
    """Distance and slow-down of the points; relative to a law over the cases that both did."""
    found = chosen(rows)
    done = found[found["done"] & found["slow"].notna()]
    marks = {m["formulation"]: m for m in shown_marks(page, "cost")}
    assert marks
    for law, mark in marks.items():
        part = done[done["contender"].eq(law)]
        assert float(mark["trials"]) == len(part)
        assert number_of(mark, "slow-down") == pytest.approx(part["slow"].median(), rel=5e-3)
        assert number_of(mark, "rms distance") == pytest.approx(part["error"].median(), rel=5e-3)
    choose(page, versus="qp, daqp")
    cases = ["scenario", "seed", "plant", "reference"]
    rival = done[done["contender"].eq("qp, daqp")].set_index(cases)
    for mark in shown_marks(page, "cost"):
        part = done[done["contender"].eq(mark["formulation"])].set_index(cases)
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
    part = found[found["contender"].eq("qp, daqp") & found["grid"].ne("")]
    assert len(part) == 4
    texts = page.execute_script(PHASE_TEXTS)
    want = part.groupby(["across", "up"])["done"].agg(["mean", "size"])
    assert sorted(texts) == sorted(f"{100 * m:.0f}% of {n:g}" for m, n in want.to_numpy())
    choose(page, quantity="peak")
    peaks = [float(text) for text in page.execute_script(PHASE_TEXTS)]
    assert np.sort(peaks) == pytest.approx(
        np.sort(part.groupby(["across", "up"])["peak"].max()), rel=5e-3
    )


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


@pytest.mark.parametrize("versus", ["best", "dls[damping=0.05]"])
def test_intervals_are_those_of_paired_differences(
    page: Any, rows: pd.DataFrame, versus: str
) -> None:
    """D +- 1.96 sqrt(sum w^2 (d - D)^2) over scenarios; told apart where 0 is outside."""
    choose(page, versus=versus, reference="any", variant="any")
    found = chosen(rows, versus=versus, reference="any", variant="any")
    rate = {name: value for name, (value, _) in expected(found).items()}
    most = found.groupby("contender").size().max()
    whole = {str(name) for name, part in found.groupby("contender") if len(part) == most}
    best = max(sorted(whole), key=lambda name: rate[name]) if versus == "best" else versus
    levels = ["family", "robot", "scenario"]
    success = found.groupby(["contender", *levels])["done"].mean()
    lines = page.execute_script(
        "return Array.from(document.querySelectorAll('#ranking tbody tr'),"
        " (row) => Array.from(row.cells, (cell) => cell.textContent))"
    )
    assert len(lines) == len(rate)
    for place, name, _, difference, interval, apart, *_ in lines:
        own = success[name]
        weight = own.index.to_frame(index=False)
        for level, above in zip(levels, [[], levels[:1], levels[:2]], strict=True):
            distinct = weight[[*above, level]].drop_duplicates()
            share = distinct.groupby(above).size() if above else len(distinct)
            weight[f"{level} share"] = 1 / (
                share if not above else weight.set_index(above).index.map(share).to_numpy()
            )
        w = weight[[f"{level} share" for level in levels]].prod(axis=1).to_numpy()
        d = (own - success[best].reindex(own.index)).to_numpy()
        mean = float(w @ d)
        half = 1.96 * float(np.sqrt(((w * (d - mean)) ** 2).sum()))
        low, high = max(-1.0, mean - half), min(1.0, mean + half)
        assert float(difference) == pytest.approx(100 * mean, abs=0.0501), name
        told = [float(each) for each in interval.split(" to ")]
        assert told == pytest.approx([100 * low, 100 * high], abs=0.0501), name
        if name in whole:
            assert apart == ("no" if low <= 0 <= high and rate[name] > 0 else "yes"), name
        else:
            assert (place, apart) == ("", ""), name


def test_the_first_view_has_bootstrapped_intervals(
    page: Any, trials: pd.DataFrame, rows: pd.DataFrame
) -> None:
    """They are those of `statistics.success` for the same trials; every control takes them away."""
    found = chosen(rows)
    facts = with_facts(trials).set_index("id").loc[found["id"]].reset_index()
    success = rates(facts, succeeded(facts))
    names = found.drop_duplicates(["formulation", "solver"]).set_index(["formulation", "solver"])
    want = {
        names["contender"][pair]: [100 * low, 100 * high]
        for pair, low, high in zip(
            success.contenders.itertuples(index=False, name=None),
            success.lower, success.upper, strict=True,
        )
    }  # fmt: skip
    said = page.execute_script(
        "return Array.from(document.querySelectorAll('#ranking tbody tr'),"
        " (row) => [row.cells[1].textContent, row.cells[4].textContent])"
    )
    assert {name for name, _ in said} == want.keys()
    for name, interval in said:
        told = [float(each) for each in interval.split(" to ")]
        assert told == pytest.approx(want[name], abs=0.0501), name
    assert "bootstrap" in page.find_element("id", "leading").text
    for control in controls(rows):
        other = next(value for value, _ in control.options if value != control.value)
        choose(page, **{control.name: other})
        text = page.find_element("id", "leading").text
        assert ("bootstrap" in text) == (control.name == "most"), control.name
        reset(page)


def test_success_over_tolerances_is_that_of_the_rows(page: Any, rows: pd.DataFrame) -> None:
    """A point for every tolerance and formulation that ran every trial."""
    choose(page, variant="any")
    found = chosen(rows, variant="any")
    most = found.groupby("contender").size().max()
    wanted = {
        (str(name), f"{1e3 * tolerance:g}"): expected(
            part.assign(done=part["outcomes"].str[k].eq("0"))
        )[str(name)][0]
        for name, part in found.groupby("contender")
        for k, tolerance in enumerate(TOLERANCES_M, start=1)
        if len(part) == most
    }
    marks = [m for m in shown_marks(page, "profile_layer_1")]
    said = {(m["formulation"], m["tolerance [mm]"]): float(m["success"]) for m in marks}
    assert said.keys() == wanted.keys()
    for key, success in wanted.items():
        assert 100 * said[key] == pytest.approx(success), key


def test_pictures_leave_out_who_did_not_run_every_trial(page: Any) -> None:
    """`pinv[after=clip]` ran one easy scenario only, in which it succeeds."""
    assert shown_ranking(page)["pinv[after=clip]"][0] > 90
    assert "pinv[after=clip]" in {mark["formulation"] for mark in shown_marks(page, "matrix")}
    for view in ("cost", "deadline", "profile"):
        shown = {mark["formulation"] for mark in shown_marks(page, view)}
        assert shown, view
        assert "pinv[after=clip]" not in shown, view
