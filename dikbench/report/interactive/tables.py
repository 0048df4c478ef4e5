"""The tables of the page, as texts: the ranking, and the trials of what was picked."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

import altair as alt

from dikbench.metrics import Outcome
from dikbench.report.interactive.charts import counted_rows, ranked
from dikbench.report.interactive.controls import Control
from dikbench.report.selection.categories import CATEGORIES
from dikbench.statistics.first_places import FEWEST_SCENARIOS

BOOTSTRAPPED: Final = "Intervals: 95 %, bootstrap over families, robots, scenarios and seeds."
APPROXIMATE: Final = "Intervals: 95 %, closed form, paired over scenarios taken as independent."


UNSEEN: Final = next(
    place for place, each in enumerate(CATEGORIES) if Outcome.DOES_NOT_SEE in each.outcomes
)
"""The category of trials that were not run: there is nothing to be seen of them."""


def ranking(controls: Sequence[Control], drawn: Sequence[Mapping[str, Any]]) -> alt.Chart:
    """Tell the ranking of a view (see `ranked`), and what is said of it in sentences."""
    limits = "limits=='broken'?', limits kept or not':''"
    return (
        ranked(controls, drawn)
        .transform_calculate(
            better="datum.apart=='yes'&&datum.difference>0?1:0",
            worse="datum.apart=='yes'&&datum.difference<0?1:0",
            same="datum.apart=='no'&&datum.contender!=versus?1:0",
        )
        .transform_joinaggregate(
            first_place="min(place)",
            most_trials="max(trials)",
            all_better="sum(better)",
            all_worse="sum(worse)",
            all_same="sum(same)",
        )
        .transform_window(
            order="row_number()",
            sort=[alt.SortField("rounded", "descending"), alt.SortField("contender")],
        )
        .transform_calculate(
            success=_percent("rate"),
            behind=_percent("difference"),
            interval=f"{_percent('lower')}+' to '+{_percent('upper')}",
            said=f"datum.contender+' ('+{_percent('rate')}+' %)'",
            view=f"'Most successful in this view'+({limits})",
            relative="versus=='best'?'':'of those shown '+datum.all_better+' are better than '"
            "+versus+', '+datum.all_worse+' worse, '+datum.all_same+' not told apart from it'",
            intervals=f"datum.is_drawn?{json.dumps(BOOTSTRAPPED)}:{json.dumps(APPROXIMATE)}",
            sample="datum.contenders+' formulations, '+datum.most_trials+' trials each, '"
            "+datum.count+' scenarios'",
            nobody="datum.enough==0"
            f"?'Nobody is ranked in this view: fewer than {FEWEST_SCENARIOS} scenarios.'"
            ":isValid(datum.first_place)?'':'In this view nobody ran every trial and succeeded.'",
        )
    )


def listed_trials(controls: Sequence[Control]) -> alt.Chart:
    """Tell the trials of what was picked, the worst first, those that did not run last."""
    names = json.dumps([each.name for each in CATEGORIES])
    return (
        counted_rows(controls)
        .transform_filter(
            "datum.contender==picked&&(where==''||datum.situation==where)"
            "&&(ended==''||datum.category==toNumber(ended))"
        )
        .transform_calculate(did_run=f"datum.category!={UNSEEN}?1:0")
        .transform_window(
            order="row_number()",
            sort=[
                alt.SortField(name, "descending") for name in ("did_run", "category", "farthest")
            ],
        )
        .transform_calculate(
            outcome=f"{names}[datum.category]",
            plays="datum.carried==1?'\N{BLACK RIGHT-POINTING TRIANGLE}':''",
            **{
                f"{name}_text": f"isValid(datum.{name})?format(datum.{name},'.3~g'):''"
                for name in ("farthest", "error", "peak", "slow")
            },
        )
    )  # fmt: skip


def _percent(name: str) -> str:
    """Return the expression for a share in percent, with a minus that is read as one."""
    return f"replace(format(100*datum.{name},'.1f'),'\N{MINUS SIGN}','-')"
