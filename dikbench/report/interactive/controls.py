"""The controls of the page: what a reader asks for, and which rows that leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import pandas as pd

from dikbench.report.interactive.page_rows import AT_REST, BOTH, TOLERANCES_M
from dikbench.report.selection.judged import DEFINITIONS, IN_WORDS

ANY: Final = "any"
ANY_OF: Final[tuple[tuple[str, ...], ...]] = ((), (ANY,))
"""What stands beside the values of a list: nothing where there is one, else any of them."""

MARKS: Final = ("picked", "where", "ended", "trial", "beside")
"""What marks that were clicked choose: a formulation, a situation and an outcome, whose trials are
listed; a trial, and another one beside it. They are in the address too."""

ONE_EACH: Final = "one each"
PERIODS_US: Final = {"100 Hz": 10000, "200 Hz": 5000, "500 Hz": 2000, "1 kHz": 1000, "2 kHz": 500,
                     "5 kHz": 200, "10 kHz": 100}  # fmt: skip
"""Control rates, and what of time they leave [us]."""


@dataclass(frozen=True)
class Control:
    """A question to the reader, answered by a list or a slider.

    Attributes:
        name: of its signal in the charts, its element in the page and its key in the address.
        label: what stands before it.
        options: the values and their texts; those of a slider are its places.
        value: at first.
        test: the expression that a row must satisfy; empty where it chooses no rows.
        slider: whether it is one.
    """

    name: str
    label: str
    options: tuple[tuple[str, str], ...]
    value: str
    test: str = ""
    slider: bool = False


def controls(rows: pd.DataFrame) -> list[Control]:
    """Make the controls for rows (see `page_rows`): those of which there is something to choose."""
    plants, robots = (_found(rows, column) for column in ("plant", "robot"))
    solvers = [solver for solver in _found(rows, "solver") if solver != "none"]
    situations = [each for each in DEFINITIONS if each in set(rows["situation"])]
    references = [each for each in IN_WORDS if each in set(rows["reference"])]
    variants = set(rows["variant"])
    laws = _found(rows, "contender")
    own = "the scenario's own"
    tolerances = [own, *(f"{1e3 * tolerance:g} mm" for tolerance in TOLERANCES_M)]
    found = [
        Control(
            "tolerance", "Tolerance", tuple((str(k), text) for k, text in enumerate(tolerances)),
            "0", slider=True,
        ),
        _list("limits", "Limits", [("kept", "must be kept"), ("broken", "may be broken")]),
        _list("reference", "Reference", [*((each, IN_WORDS[each]) for each in references),
              *ANY_OF[len(references) > 1]],
              test="reference=='any'||datum.reference==reference||datum.reference=='rest'"),
        _list("situation", "Situation", [*ANY_OF[len(situations) > 1], *situations],
              test="situation=='any'||datum.situation==situation"),
        _list("robot", "Robot", [*ANY_OF[len(robots) > 1], *robots],
              test="robot=='any'||datum.robot==robot"),
        _list("plant", "Plant", [*sorted(plants, key=lambda each: each != "ideal"),
              *ANY_OF[len(plants) > 1]],
              test="plant=='any'||datum.plant==plant"),
        _list("rate", "Rate", [(ANY, ANY), *((str(us), f"{text}: {us} us") for text, us in
              PERIODS_US.items())],
              test="rate=='any'||(isValid(datum.deadline)&&datum.deadline<=toNumber(rate))"),
        _list("variant", "Parameters",
              [*(each for each in ("tuned", "default") if each in variants), ANY],
              test="variant=='any'||datum.variant==variant||datum.variant=='both'"),
        _list("solver", "Solver",
              [(ONE_EACH, "one each"), ANY, ("cold", "cold interface"), ("warm", "warm interface"),
               *solvers],
              test="solver=='any'||datum.solver=='none'||datum.solver==solver"
              "||datum.interface==solver||(solver=='one each'&&datum.first==1)"),
        _list("versus", "Relative to", [("best", "the best"), *laws]),
        _list("most", "Show", [("16", "the first 16"), ("999", "all")]),
    ]  # fmt: skip
    return [each for each in found if len(each.options) > 1]


def rows_at_first(rows: pd.DataFrame, every: Sequence[Control]) -> pd.DataFrame:
    """Return the rows that the controls leave before any of them was moved."""
    values = {each.name: each.value for each in every}
    found = rows[rows["first"].eq(1)] if values.get("solver") == ONE_EACH else rows
    for name in ("reference", "plant", "variant"):
        if values.get(name, ANY) != ANY:
            found = found[found[name].isin([values[name], AT_REST, BOTH])]
    return found


def is_at_first(every: Sequence[Control]) -> str:
    """Return the expression that is true where `rows_at_first` are left, each told from the best.

    How many are shown changes nothing.
    """
    return "&&".join(f"{each.name}=='{each.value}'" for each in every if each.name != "most")


def phase_controls(rows: pd.DataFrame) -> list[Control]:
    """Make the controls of the phase diagram; none where no family spans one."""
    grids = [grid for grid in _found(rows, "grid") if grid]
    if not grids:
        return []
    laws = _found(rows[rows["grid"].ne("")], "contender")
    quantities = [("success", "success"), ("error", "rms distance [mm]"),
                  ("peak", "peak speed over limit")]  # fmt: skip
    return [
        _list("phase", "Phase diagram of", laws),
        _list("grid", "in", grids),
        _list("quantity", "showing", quantities),
    ]


def filter_of(every: Sequence[Control]) -> str:
    """Return the expression that is true for the rows that the controls leave."""
    return "&&".join(f"({each.test})" for each in every if each.test) or "true"


def _list(
    name: str, label: str, options: Sequence[str | tuple[str, str]], test: str = ""
) -> Control:
    pairs = tuple((each, each) if isinstance(each, str) else each for each in options)
    first = pairs[0][0] if pairs else ""  # as of a run of targets at rest: nothing to choose
    return Control(name, label, pairs, first, test)


def _found(rows: pd.DataFrame, column: str) -> list[str]:
    values: list[Any] = rows[column].dropna().unique().tolist()
    return sorted(str(value) for value in values if value != "")
