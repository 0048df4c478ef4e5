from __future__ import annotations

import re
from pathlib import Path

import pytest
from makers.rows import make_rows, write_results

from dikbench.plugins.building import make_scenario
from dikbench.plugins.finding import plugins
from dikbench.report.contents.contents import gather
from dikbench.report.contents.docstring import parse_docstring
from dikbench.report.contents.formulations_and_families import families_of, formulations_of
from dikbench.report.pages.markdown_page import render_markdown
from dikbench.results.instances import write_attempts
from dikbench.results.reading import read_results, without_attributes
from dikbench.scenario.situation import Situation
from dikbench.study.instances import Attempt

FORMULATION = '''
raise SystemExit("this file was run")

class Mine:
    """A formulation of mine: slowly.

        v = gain J^T V

    What it is good at.

    Attributes:
        gain: how much [rad/m],
            and more.

    Source: [Mine2026].
    """

    gain: float = 0.5
    after: str = "clip"
    program: ClassVar[str] = "qp"
'''


def test_a_law_given_as_a_file_is_read_and_not_run(tmp_path: Path) -> None:
    """Results name files; remaking a report takes the docstring from them and executes nothing."""
    file = tmp_path / "mine.py"
    file.write_text(FORMULATION)
    [formulation] = formulations_of(make_rows({f"{file}:Mine[gain=2]": {}}))
    assert formulation.text is not None
    assert formulation.text.summary == "A formulation of mine: slowly."
    assert formulation.text.titled == {"Source": "[Mine2026]"}
    assert formulation.text.entries == {"gain": "how much [rad/m], and more."}
    assert formulation.variants[0].attributes == {"gain": "2", "after": "'clip'"}


@pytest.mark.parametrize("content", [None, "", "def f(", "\x00", "class Other: pass"])
def test_a_law_whose_file_says_nothing_is_named_all_the_same(
    tmp_path: Path, content: str | None
) -> None:
    """A file that is gone, empty or no Python leaves the formulation without a text."""
    if content is not None:
        (tmp_path / "mine.py").write_text(content)
    [formulation] = formulations_of(make_rows({f"{tmp_path / 'mine.py'}:Mine": {}}))
    assert formulation.text is None
    assert formulation.name.endswith("mine.py:Mine")


def test_variants_of_a_law_stand_together_with_every_attribute() -> None:
    """What was given goes before the defaults; solvers are those with which it ran."""
    rows = make_rows(
        {
            ("qp", "daqp"): {},
            ("qp", "osqp"): {},
            "oracle": {},
            ("qp[damping=0.1]", "daqp"): {},
            "unheard-of": {},
        }
    )
    qp, unheard_of, oracle = formulations_of(rows)
    assert [variant.selector for variant in qp.variants] == ["qp", "qp[damping=0.1]"]
    assert qp.variants[0].solvers == ("daqp", "osqp")
    assert [variant.attributes["damping"] for variant in qp.variants] == ["0.001", "0.1"]
    assert any(text.startswith("[Tedrake] R. Tedrake.") for text in qp.references)
    assert unheard_of.text is None
    assert oracle.name == "oracle"


@pytest.mark.parametrize("kind", ["formulation", "scenario"])
def test_every_shipped_docstring_is_taken_apart(kind: str) -> None:
    """Nothing of a docstring is lost: each of its words stands in one of the parts."""
    for plugin in plugins(kind).values():
        text = plugin.factory.__doc__ or ""
        parsed = parse_docstring(text)
        assert parsed.summary == plugin.summary
        assert "Source" in parsed.titled
        explained = set(re.findall(r"^ +(\w+): ", text, re.MULTILINE))
        assert set(parsed.entries) >= explained & set(plugin.parameters), plugin.name
        parts = [
            parsed.summary,
            *(paragraph.text for paragraph in parsed.paragraphs),
            *(f"{name}: {said}" for name, said in parsed.entries.items()),
            *(f"{title}: {said}." for title, said in parsed.titled.items()),
        ]
        words = set(" ".join(parts).replace(",", " ").replace(":", " ").replace(".", " ").split())
        lost = set(text.replace(",", " ").replace(":", " ").replace(".", " ").split()) - words
        assert lost <= {"Attributes", "Args"}, plugin.name


def test_families_say_what_they_certify() -> None:
    """The claims are those of the scenario itself; what cannot be built says why."""
    selectors = ("near-miss[miss=0.02]", "near-miss[miss=-1]", "unheard-of")
    near_miss, unheard_of = families_of(make_rows({"pinv": {}}, selectors))
    claims = make_scenario(selectors[0]).certificate.claims
    assert near_miss.scenarios[0].claims == tuple(str(claim) for claim in claims)
    assert "miss" in near_miss.scenarios[1].problem
    assert near_miss.text is not None
    assert near_miss.text.titled["Provokes"].startswith("joint speeds beyond the limits")
    assert unheard_of.text is None
    assert "unheard-of" in unheard_of.scenarios[0].problem


@pytest.mark.parametrize(
    ("scenario", "situation"),
    [
        ("obstacle[where=elbow]", "obstacles or torques"),
        ("torque-limited", "obstacles or torques"),
        ("step", "steps"),
        ("hold-still", "free space"),
        ("start-outside", "start outside"),
        ("joint-limit-crossing", "at joint limits"),
        ("joint-limit-approach", "at joint limits"),
        ("near-miss[miss=0.02]", "near singularities"),
        ("near-miss[miss=0.2,speed=0.1]", "free space"),
        ("speed-sweep[speed=1.3]", "beyond joint speed"),
        ("speed-sweep[speed=0.7]", "free space"),
    ],
)
def test_scenarios_are_what_their_joint_motion_asks_for(
    scenario: str, situation: Situation
) -> None:
    """The situation is measured and not read off a name: a wide miss is free space."""
    assert make_scenario(scenario).situation == situation


def test_skipped_cells_are_no_trials_of_the_heading(tmp_path: Path) -> None:
    """They are counted apart; what failed was run."""
    rows = make_rows(
        {"pinv": {}, "dls": {"status": ["crashed", "skipped"], "outcome": ["did-not-run", ""]}},
        ("reach", "near-miss"),
    )
    folder = write_results(tmp_path / "out", rows)
    contents = gather(without_attributes(read_results(folder, lenient=True)), ())
    assert contents.counts[:3] == [
        (3, "of 4 planned trials run"), (1, "failed"), (1, "cell skipped"),
    ]  # fmt: skip


def test_a_row_on_what_was_never_drawn_is_not_the_studys(tmp_path: Path) -> None:
    """It has the number and the family of an instance; `instances.csv` knows it not."""
    drawn, other = (f"reach[robot=ur5,distance={far},angle=0.2]" for far in (0.05, 0.06))
    study = {
        "name": "a", "description": "Two", "scenarios": ["reach"], "split": "test", "instances": 2,
        "cells": [{"formulations": ["pinv"]}],
    }  # fmt: skip
    rows = make_rows({"pinv": {}}, (drawn, other), seeds=(100,))
    folder = write_results(tmp_path / "out", rows, study=study, trials=2)
    write_attempts(folder, [Attempt("reach", "0" * 16, 100, drawn, 100)])
    said = gather(without_attributes(read_results(folder, lenient=True)), ())
    assert (1, "missing") in said.counts
    assert any(each.text.startswith("1 row of earlier runs") for each in said.limitations)
    assert said.description == "As it was planned: Two."


def test_the_heading_says_what_ran_and_what_was_planned_where_they_differ(tmp_path: Path) -> None:
    """Of trials, formulations, scenarios and seeds; a study that ran is described as it is."""
    rows = make_rows(
        {"pinv": {}, "dls": {"status": "skipped", "outcome": ""}}, ("reach", "step"), (0, 1)
    )
    study = {"name": "a", "description": "Two of four", "seeds": [0, 1, 2]}
    study["scenarios"] = ["reach", "step", "hold-still"]
    folder = write_results(tmp_path / "part", rows, study=study, trials=18)
    contents = gather(without_attributes(read_results(folder, lenient=True)), ())
    assert contents.counts == [
        (4, "of 18 planned trials run"),
        (0, "failed"),
        (4, "cells skipped"),
        (10, "missing"),
        (1, "of 2 planned formulations with their solvers"),
        (2, "of 3 planned scenarios"),
        (2, "of 3 planned seeds"),
    ]
    assert contents.description == "As it was planned: Two of four."
    page = render_markdown(contents)
    assert "As it was planned: Two of four.\n\n4 of 18 planned trials run, 0 failed, " in page
    whole = write_results(tmp_path / "whole", make_rows({"pinv": {}}, ("reach", "step")))
    contents = gather(without_attributes(read_results(whole, lenient=True)), ())
    assert contents.description == "Rows that nobody ran."
    assert contents.counts == [
        (2, "trials run"), (0, "failed"), (1, "formulation with its solver"), (2, "scenarios"),
        (1, "seed"),
    ]  # fmt: skip
