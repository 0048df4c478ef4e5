"""Numbers and names in sentences."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
from makers.rows import make_rows

from dikbench.report.sentences.words import FEW, Names, listed, number


def test_solvers_are_named_as_shortly_as_they_can() -> None:
    """All of them, all but a few, or one by one."""
    rows = make_rows(
        {("qp", solver): {} for solver in ("daqp", "osqp", "piqp", "highs")} | {"a": {}}
    )
    names = Names(rows)
    assert names.of([("a", "none")]) == "`a`"
    every = [("qp", solver) for solver in ("daqp", "osqp", "piqp", "highs")]
    assert names.of(every) == "`qp` (all 4 solvers)"
    assert names.of(every[1:]) == "`qp` (all solvers but `daqp`)"
    assert names.of(every[:2]) == "`qp` (`daqp` and `osqp`)"


@given(st.permutations([f"f{k}" for k in range(9)]))
def test_the_order_of_rows_and_of_names_changes_no_sentence(order: list[str]) -> None:
    """Names that are equally good stand in order of the alphabet; the others are counted."""
    names = Names(make_rows({name: {} for name in order}))
    assert names.of([(name, "none") for name in order]) == (
        "`f0`, `f1`, `f2`, `f3`, `f4`, `f5` and 3 more"
    )


@given(st.integers(1, 20))
def test_at_most_six_names_are_listed(count: int) -> None:
    """The rest is counted; nobody is lost."""
    text = listed([f"`n{k}`" for k in range(count)])
    named = text.count("`") // 2
    assert named == min(count, FEW) <= 6
    more = int(text.rsplit(" and ", 1)[1].split()[0]) if text.endswith("more") else 0
    assert named + more == count


@given(st.floats(1e-8, 1e8))
def test_a_number_in_a_sentence_is_the_number(value: float) -> None:
    """Three significant digits: within half a percent of the value, and readable as a number."""
    assert math.isclose(float(number(value)), value, rel_tol=5.001e-3)
