"""The charts of the page put together, as Vega reads them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import altair as alt
import pandas as pd
import vl_convert

from dikbench.report.interactive.charts import ROWS, matrix
from dikbench.report.interactive.controls import MARKS, Control, controls, phase_controls
from dikbench.report.interactive.default_intervals import default_intervals
from dikbench.report.interactive.pictures import cost, deadline, phase, profile, sensitivity
from dikbench.report.interactive.tables import listed_trials, ranking
from dikbench.report.selection.judged import DEFINITIONS

VEGA_LITE: Final = "6.4"
"""The version of Vega-Lite whose bundle is in the page."""

EMBEDDING: Final[dict[str, Any]] = {"embedOptions": {"renderer": "svg", "actions": False}}
"""How the page shows the charts: their marks can be read, and there is no menu beside them."""


@dataclass(frozen=True, eq=False)
class Charts:
    """What the page embeds.

    Attributes:
        specification: of Vega.
        controls: of the rows.
        phase: of the phase diagram.
        ranking: name of the data set with a row per law.
        trials: name of the data set with the rows that the controls leave.
    """

    specification: dict[str, Any]
    controls: list[Control]
    phase: list[Control]
    ranking: str
    trials: str


def make_charts(rows: pd.DataFrame) -> Charts:
    """Declare the charts of rows (see `page_rows`)."""
    asked, of_phase = controls(rows), phase_controls(rows)
    situations = [each for each in DEFINITIONS if each in set(rows["situation"])]
    pictures = [cost(asked), profile(asked)]
    if rows["deadline"].notna().any():
        pictures.insert(1, deadline(asked))
    if of_phase:
        grids = [grid.rpartition(": ")[2] for grid in rows["grid"].unique() if grid]
        named = grids[0] if len(set(grids)) == 1 else "second parameter over first parameter"
        up, _, across = named.partition(" over ")
        pictures.append(phase(asked, across, up))
    if rows["swept"].ne("").any():
        swept = sorted(set(rows["swept"]) - {""})
        pictures.append(sensitivity(asked, swept[0] if len(swept) == 1 else "a parameter"))
    drawn = default_intervals(rows, asked)
    tables = [
        table.mark_text(fontSize=0).encode(text="order:Q").properties(width=1, height=1, name=name)
        for name, table in (("ranking", ranking(asked, drawn)), ("trials", listed_trials(asked)))
    ]
    chart = (
        alt.vconcat(
            matrix(asked, drawn, situations),
            alt.concat(*pictures, columns=3, spacing=40).resolve_scale(
                color="independent", size="independent"
            ),
            alt.hconcat(*tables),
            spacing=30,
        )
        .resolve_scale(color="independent")
        .add_params(
            *(alt.param(each.name, value=each.value) for each in (*asked, *of_phase)),
            *(alt.param(name, value="") for name in MARKS),
        )
        .configure(background="transparent", padding=0)
        .configure_view(stroke=None)
        .configure_axis(
            labelColor="currentColor", titleColor="currentColor", gridColor="#8884",
            domainColor="#8888", tickColor="#8888", labelFontSize=11, titleFontSize=12,
            titleFontWeight="normal",
        )
        .configure_legend(labelColor="currentColor")
        .configure_title(color="currentColor", anchor="start", fontSize=13)
    )  # fmt: skip
    lite = json.loads(chart.to_json(indent=None))
    lite["datasets"] = {**lite.get("datasets", {}), ROWS: []}
    lite["usermeta"] = EMBEDDING
    vega = vl_convert.vegalite_to_vega(lite, vl_version=VEGA_LITE)
    return Charts(vega, asked, of_phase, _data_of(vega, "ranking"), _data_of(vega, "trials"))


def bundle() -> str:
    """Return Vega and its embedding, for a page without a network."""
    made = vl_convert.javascript_bundle(vl_version=VEGA_LITE)  # type: ignore[call-arg]
    return str(made)  # the stub does not know that a snippet may be left out


def _data_of(vega: Any, view: str) -> str:
    """Find the data set that the marks of a view are of."""
    for node in _nodes(vega):
        if node.get("name") == f"{view}_marks" and "from" in node:
            return str(node["from"]["data"])
    raise LookupError(view)


def _nodes(tree: Any) -> Iterator[dict[str, Any]]:
    if isinstance(tree, dict):
        yield tree
        tree = list(tree.values())
    if isinstance(tree, list):
        for each in tree:
            yield from _nodes(each)
