"""Advice in words and as a page, of an arm that nobody ran."""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import Any

import pandas as pd
from makers.rows import FAULTLESS, make_rows

from dikbench.advice.advising import Advice, chosen_contender
from dikbench.advice.answering import Standing, answers
from dikbench.advice.arm import look_at
from dikbench.advice.contender import contender
from dikbench.advice.needs import Need
from dikbench.advice.pictures import draw_phases
from dikbench.advice.presenting import present
from dikbench.advice.trying import DISTURBED, Tries
from dikbench.run.in_workers import RunSettings
from dikbench.selector import Selector

LAWS = ("qp", "dls", "<b>law</b>")


def made_up(folder: Path) -> tuple[list[tuple[str, list[str]]], str, str]:
    """Present advice from rows that are made up: `qp` does all, `dls` leaves three of the paths."""
    rows: list[dict[str, Any]] = []
    cases = [(Selector("near-miss", {"robot": "ur5", "speed": f"0.{n}"}), n) for n in range(1, 9)]
    for scenario, seed in cases:
        for law in LAWS:
            for reference, plant in (("path", "ideal"), ("time", "ideal"), ("time", DISTURBED)):
                failed = law != "qp" and seed % 3 == 1
                rows.append(
                    {
                        **FAULTLESS,
                        "formulation": law, "solver": "none", "scenario": str(scenario),
                        "plant": str(plant), "reference": reference, "seed": seed,
                        "outcome": "left-path" if failed else "success",
                        "contour_error_6d_max_m": 0.1 if failed else 1e-4,
                    }
                )  # fmt: skip
    tries = Tries(rows, cases, 8, 10.0)
    trials = tries.trials
    needs = [Need("on-path"), Need("limits")]
    found = answers(needs, trials[trials["plant"].eq("ideal")])
    advice = Advice(
        look_at("ur5"), 0.01, found, tries, [contender("qp"), contender("dls")],
        {"hexagon": "there is <none>"}, found[0].first, no_search="no time", no_phase="no time",
    )  # fmt: skip
    page = folder / "advice.html"
    chapters, program = present(advice, folder, page, RunSettings(1), "dikbench advise ur5")
    return chapters, program, page.read_text(encoding="utf-8")


def test_the_page_says_what_the_terminal_says(tmp_path: Path) -> None:
    """Every line of it, in a file without network; names of plug-ins are text, not markup."""
    chapters, program, page = made_up(tmp_path)
    text = html.unescape(re.sub(r"<[^>]*>", "", page))
    for heading, lines in chapters:
        for line in [heading, *lines]:
            assert line.replace("`", "") in text
    assert program in text
    assert "<b>law</b>" not in page
    assert "<none>" not in page
    assert not re.search(r"""(src|href)=["'](?!data:)""", page)
    assert page.count("<img") == 1


def test_the_sentences_have_the_numbers_of_the_rows(tmp_path: Path) -> None:
    """Who is recommended and how often it failed, by the rows."""
    chapters, program, _ = made_up(tmp_path)
    lines = dict(chapters)
    assert "`qp`: 0 of 8 runs" in lines["What is recommended"][0]
    assert "`dls` (3 of 8 runs)" in lines["What is recommended"][0]
    [will_not] = [lines[name] for name in lines if "will not do" in name]
    assert "it did its job in 8 of 8 runs" in will_not[0]
    assert "2 steps late, it did its job in 8 of 8 runs" in will_not[-1]
    assert any("no case of hexagon" in line for line in lines["The sample"])
    assert "formulation='qp'" in program
    assert len(pd.read_csv(tmp_path / "advice.csv")) == 8 * 3 * len(LAWS)


def test_what_is_chosen_is_a_contender() -> None:
    """Its texts are selectors again."""
    law = contender("dls[damping=0.1]")
    standing = Standing(str(law.formulation), str(law.solver), 1.0, 0, 8, 0.1, 1.0)
    assert chosen_contender(standing) == law


def test_a_grid_of_near_misses_is_drawn(tmp_path: Path) -> None:
    """With a panel for each of two laws, in the style of all figures; nothing where none ran."""
    names = [f"near-miss[robot=ur5,miss={m},speed={s}]" for m in (0.01, 0.05) for s in (0.1, 1.0)]
    trials = make_rows({"dls": {}, "qp": {"outcome": "left-path"}}, names, reference="path")
    figures = draw_phases(trials, tmp_path)
    assert any("outcome" in each.file for each in figures)
    for each in figures:
        assert (tmp_path / each.file).stat().st_size > 1000
    assert draw_phases(None, tmp_path) == []
