"""The pictures below the matrix: what accuracy and success cost, and where they end."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, Final

import altair as alt

from dikbench.report.interactive.charts import (
    BAD,
    CHOSEN,
    GOOD,
    NAMED,
    OTHER,
    TIED,
    category_at,
    comparable,
    counted_rows,
)
from dikbench.report.interactive.controls import Control
from dikbench.report.interactive.page_rows import TOLERANCES_M

WIDTH_PX: Final = 290
HEIGHT_PX: Final = 240

_CASE: Final[list[Any]] = ["scenario", "seed", "plant", "reference"]

LEAST_RATE: Final = 0.3
"""Who succeeds less often has too few trials to be compared in what they cost."""


def _colours() -> Any:
    """Colour the law that the others are relative to."""
    return alt.condition("datum.contender==versus", alt.value(CHOSEN), alt.value(TIED))


def cost(controls: Sequence[Control]) -> Any:
    """Draw distance from the path against slow-down: medians over a law's own successes.

    Relative to a law, over the trials in which both succeed, as ratios.
    """
    common = "versus=='best'||(isValid(datum.error_of)&&isValid(datum.slow_of))"
    found = (
        comparable(counted_rows(controls))
        .transform_filter("datum.done==1&&isValid(datum.error)&&isValid(datum.slow)")
        .transform_calculate(
            of_error="datum.contender==versus?datum.error:null",
            of_slow="datum.contender==versus?datum.slow:null",
        )
        .transform_joinaggregate(error_of="max(of_error)", slow_of="max(of_slow)", groupby=_CASE)
        .transform_filter(common)
        .transform_calculate(
            x="max(1e-3,versus=='best'?datum.error:datum.error/max(1e-6,datum.error_of))",
            y="versus=='best'?datum.slow:datum.slow/datum.slow_of",
        )
        .transform_aggregate(
            x="median(x)", y="median(y)", rate="max(rate)", n="count()", groupby=["contender"]
        )
        .transform_filter(f"datum.rate>={LEAST_RATE}||datum.contender==versus")
    )
    x = "rms distance, median of its own successes [mm], or ratio"
    y = "slow-down, median likewise, or ratio"
    return _scatter(found, x, y, "What accuracy costs", "cost")


def deadline(controls: Sequence[Control]) -> Any:
    """Draw success against the time of a control step, with the deadline of the rate."""
    found = (
        comparable(counted_rows(controls))
        .transform_aggregate(
            x="max(deadline)", y="max(rate)", rate="max(rate)", n="count()", groupby=["contender"]
        )
        .transform_filter("isValid(datum.x)&&datum.x>0")
    )
    points = _scatter(found, "time of a step, p99, largest of the timed scenarios [us]",
                      "success", "What success costs", "deadline", log_y=False)  # fmt: skip
    line = (
        alt.Chart(alt.InlineData([{}]))
        .transform_calculate(at="rate=='any'?1000:toNumber(rate)", seen="rate=='any'?0:1")
        .mark_rule(color=BAD, strokeDash=[4, 3])
        .encode(
            alt.X("at:Q", scale=alt.Scale(type="log")),
            opacity=alt.condition("datum.seen==1", alt.value(1), alt.value(0)),
        )
    )
    return alt.layer(points, line).properties(name="deadlines")


def _scatter(found: alt.Chart, x: str, y: str, title: str, name: str, *, log_y: bool = True) -> Any:
    """Draw a point for each law, larger where it succeeds more often."""
    across = alt.X("x:Q", title=x, scale=alt.Scale(type="log", nice=False, padding=14))
    scale = alt.Scale(type="log", nice=False, padding=12) if log_y else alt.Scale(domain=[0, 1])
    return (
        found.mark_circle(cursor="pointer", opacity=0.6, stroke="currentColor", strokeWidth=0.4)
        .encode(
            across, alt.Y("y:Q", title=y, scale=scale), color=_colours(),
            size=alt.Size("rate:Q", scale=alt.Scale(domain=[0, 1], range=[12, 240]), legend=None),
            tooltip=[
                NAMED, alt.Tooltip("x:Q", format=".3~g"),
                alt.Tooltip("y:Q", format=".3~g"), alt.Tooltip("rate:Q", format=".0%",
                title="success"), alt.Tooltip("n:Q", title="trials"),
            ],
        )
        .properties(width=WIDTH_PX, height=HEIGHT_PX, title=title, name=name)
    )  # fmt: skip


def profile(controls: Sequence[Control]) -> Any:
    """Draw success against the tolerance: a line for each law, that of `versus` set off."""
    millimetres = json.dumps([1e3 * tolerance for tolerance in TOLERANCES_M])
    places: list[Any] = [f"at{k}" for k in range(1, 1 + len(TOLERANCES_M))]
    rows = counted_rows(controls).transform_calculate(
        **{place: f"{category_at(str(k))}==0?1:0" for k, place in enumerate(places, start=1)}
    )
    by_scenario = comparable(rows).transform_calculate(
        **{f"{place}_w": f"datum.w*datum.{place}" for place in places}
    )
    found = (
        by_scenario.transform_aggregate(
            **dict[Any, Any]({place: f"sum({place}_w)" for place in places}),
            rate="max(rate)", n="count()", groupby=["contender"],
        )
        .transform_window(dense="dense_rank()", sort=[alt.SortField("rate", "descending")])
        .transform_filter("datum.dense<=toNumber(most)||datum.contender==versus")
        .transform_fold(places, as_=["place", "success"])
        .transform_calculate(millimetres=f"{millimetres}[toNumber(slice(datum.place,2))-1]")
    )  # fmt: skip
    x = alt.X("millimetres:Q", title="tolerance [mm]", scale=alt.Scale(type="log", nice=False),
              axis=alt.Axis(values=[1e3 * t for t in TOLERANCES_M], format="~g"))  # fmt: skip
    y = alt.Y("success:Q", title="success", scale=alt.Scale(domain=[0, 1]))
    colour = alt.condition("datum.contender==versus", alt.value(CHOSEN), alt.value(OTHER))
    tooltip = [
        NAMED,
        alt.Tooltip("millimetres:Q", title="tolerance [mm]"),
        alt.Tooltip("success:Q", format=".1%"),
        alt.Tooltip("n:Q", title="trials"),
    ]
    lines = found.mark_line(strokeWidth=1.5, opacity=0.55).encode(
        x, y, detail="contender:N", color=colour
    )
    points = found.mark_circle(size=22, cursor="pointer").encode(
        x, y, color=colour, tooltip=tooltip
    )
    return alt.layer(lines, points).properties(
        width=WIDTH_PX, height=HEIGHT_PX, title="Success against tolerance", name="profile"
    )


def phase(controls: Sequence[Control], across: str, up: str) -> Any:
    """Draw a phase diagram: success, distance or peak speed over distance and speed.

    It is of the formulation chosen for it, whatever `variant` and `solver` choose.

    Args:
        controls: of the rows.
        across: what the first parameter of the families is called.
        up: what the second one is called.
    """
    found = (
        counted_rows([each for each in controls if each.name not in {"variant", "solver"}])
        .transform_filter("datum.contender==phase&&datum.grid==grid")
        .transform_aggregate(
            success="mean(done)", error="median(error)", peak="max(peak)", n="count()",
            groupby=["across", "up"],
        )
        .transform_calculate(
            good="quantity=='success'?datum.success:quantity=='error'"
            "?1-clamp((log(max(1e-2,datum.error))/log(10)+2)/4,0,1):1-clamp(datum.peak-1,0,1)",
            text="quantity=='success'?format(datum.success,'.0%')+' of '+datum.n:quantity=='error'"
            "?format(datum.error,'.2~g'):format(datum.peak,'.3~g')",
        )
    )  # fmt: skip
    x = alt.X("across:O", title=across, axis=alt.Axis(labelAngle=0))
    y = alt.Y("up:O", sort="descending", title=up)
    tooltip = [
        alt.Tooltip("across:O"), alt.Tooltip("up:O"), alt.Tooltip("success:Q", format=".0%"),
        alt.Tooltip("error:Q", format=".3~g", title="rms distance, median [mm]"),
        alt.Tooltip("peak:Q", format=".3~g", title="peak speed over limit, largest"),
        alt.Tooltip("n:Q", title="trials"),
    ]  # fmt: skip
    cells = found.mark_rect(cursor="pointer").encode(
        x, y, tooltip=tooltip,
        color=alt.Color("good:Q", legend=None,
                        scale=alt.Scale(domain=[0, 0.5, 1], range=[BAD, "#F6DFA4", GOOD])),
    )  # fmt: skip
    numbers = found.mark_text(color="#000").encode(x, y, text="text:N")
    return alt.layer(cells, numbers).properties(
        width=WIDTH_PX, height=HEIGHT_PX, title="Phase diagram", name="phase"
    )


def sensitivity(controls: Sequence[Control], parameter: str) -> Any:
    """Draw success against the parameter of a formulation, whatever `variant` chooses.

    Args:
        controls: of the rows.
        parameter: what it is called.
    """
    free = [each for each in controls if each.name != "variant"]
    found = (
        comparable(counted_rows(free).transform_filter("datum.swept!=''"))
        .transform_aggregate(
            rate="max(rate)", n="count()", tuned="max(is_tuned)",
            groupby=["contender", "swept", "value"],
        )
    )  # fmt: skip
    x = alt.X("value:Q", title=parameter, scale=alt.Scale(type="log", nice=False, padding=14))
    y = alt.Y("rate:Q", title="success", scale=alt.Scale(domain=[0, 1]))
    tooltip = [NAMED, alt.Tooltip("rate:Q", format=".1%", title="success"),
               alt.Tooltip("n:Q", title="trials")]  # fmt: skip
    lines = found.mark_line(color=TIED).encode(x, y, detail="swept:N")
    points = found.mark_circle(size=60, cursor="pointer", opacity=1).encode(
        x, y, tooltip=tooltip,
        color=alt.condition("datum.tuned==1", alt.value(CHOSEN), alt.value(TIED)),
    )  # fmt: skip
    return alt.layer(lines, points).properties(
        width=WIDTH_PX, height=HEIGHT_PX, title="Sensitivity to a parameter", name="sensitivity"
    )
