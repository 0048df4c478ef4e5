"""The charts of one run or two over time, with a cursor."""

from __future__ import annotations

import json
from typing import Any, Final

import altair as alt
import vl_convert

from dikbench.report.interactive.charts import BAD, CHOSEN, TIED
from dikbench.report.interactive.specification import EMBEDDING, VEGA_LITE

SERIES: Final = (
    ("error", "to the target [mm]", None),
    ("speed", "speed over limit", 1.0),
    ("margin", "joint margin [deg]", 0.0),
)
"""What is drawn, and the limit of it."""

WIDTH_PX: Final = 1050
HEIGHT_PX: Final = 95


def trace_charts() -> dict[str, Any]:
    """Declare the charts of a data set `series`, a run each, with a signal `cursor` [s].

    A run has its contender and what `replays` says of it, of which dt, step and those of `SERIES`
    are drawn.
    """
    parts = [_lines(name, title, limit) for name, title, limit in SERIES]
    chart = (
        alt.vconcat(*parts, spacing=8)
        .add_params(alt.param("cursor", value=0))
        .configure(background="transparent")
        .configure_view(stroke=None)
        .configure_axis(labelColor="currentColor", titleColor="currentColor", gridColor="#8884",
                        titleFontWeight="normal")
        .configure_legend(labelColor="currentColor", labelLimit=0)
    )  # fmt: skip
    lite = json.loads(chart.to_json(indent=None))
    lite["datasets"] = {**lite.get("datasets", {}), "series": []}
    lite["usermeta"] = EMBEDDING
    vega: dict[str, Any] = vl_convert.vegalite_to_vega(lite, vl_version=VEGA_LITE)
    return vega


def _lines(name: str, title: str, limit: float | None) -> Any:
    first, last = name == SERIES[0][0], name == SERIES[-1][0]
    runs = alt.Chart(alt.NamedData(name="series"))
    data = runs.transform_flatten(["step", name]).transform_calculate(t="datum.step*datum.dt")
    legend = alt.Legend(orient="top", title=None) if first else None
    lines = data.mark_line(strokeWidth=2).encode(
        alt.X("t:Q", title="time [s]" if last else None),
        alt.Y(f"{name}:Q", title=title),
        color=alt.Color(
            "contender:N", legend=legend, sort=None, scale=alt.Scale(range=[TIED, CHOSEN])
        ),
    )
    cursor = (
        runs.transform_aggregate(n="count()")
        .transform_calculate(at="cursor")
        .mark_rule(strokeDash=[3, 3], color="#888")
        .encode(x="at:Q")
    )
    layers = [lines, cursor]
    if limit is not None:
        bound = alt.Chart(alt.InlineData([{"limit": limit}])).mark_rule(color=BAD)
        layers.append(bound.encode(y="limit:Q"))
    return alt.layer(*layers).properties(width=WIDTH_PX, height=HEIGHT_PX)
