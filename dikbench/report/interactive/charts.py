"""The charts of the page, declared over its rows: nothing is computed but what stands here."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

import altair as alt

from dikbench.report.interactive.controls import Control, filter_of, is_at_first
from dikbench.report.interactive.page_rows import TOLERANCES_M
from dikbench.report.selection.categories import CATEGORIES
from dikbench.statistics.first_places import FEWEST_SCENARIOS

ROWS: Final = "rows"
"""The data set that the page fills."""

DEVIATIONS: Final = 1.96
"""Of a 95 % interval, in standard deviations."""

GOOD: Final = "#0B7A75"
OTHER: Final = "#8a8f98"
TIED: Final = "#17978F"
"""`GOOD`, seen on a dark ground as well where it is thin or pale."""

CHOSEN: Final = "#B4468F"
BAD: Final = "#C8502B"

NAMED: Final = alt.Tooltip("contender:N", title="formulation")
"""What a mark says first."""

ROW_PX: Final = 20
OVERALL_PX: Final = 170
SITUATION_PX: Final = 126
BAR_SHARE: Final = 0.74
"""Of a situation's width; its number takes the rest."""


def category_at(tolerance: str) -> str:
    """Return the expression for the category of a row at the place of a tolerance."""
    place = f"{tolerance}+(limits=='kept'?0:{1 + len(TOLERANCES_M)})"
    return f"toNumber(slice(datum.outcomes,{place},1+{place}))"


def counted_rows(controls: Sequence[Control]) -> alt.Chart:
    """Take the rows that the controls leave, with their category and whether they succeed."""
    return (
        alt.Chart(alt.NamedData(name=ROWS))
        .transform_filter(filter_of(controls))
        .transform_calculate(category=category_at("toNumber(tolerance)"))
        .transform_calculate(done="datum.category==0?1:0")
    )


def weighted(rows: alt.Chart, *within: str) -> alt.Chart:
    """Weigh the rows of each law: families alike, then robots, scenarios and what is below.

    It adds `w`, which sums to 1 for each law (and each value of `within`), as
    `statistics.success.hierarchical_weights` does; `rate`, the share of success in it; `trials`,
    their number; and `whole`, whether no other law has more of them. Their names end in that of
    `within`: a field that is computed from itself, or written twice, would change whenever Vega
    computes a part of the charts anew.
    """
    end = "".join(f"_in_{each}" for each in within)
    of_each: list[Any] = ["contender", *within]
    product = "*".join(
        f"datum.{each}{end}" for each in ("families", "robots", "scenarios", "cases")
    )
    for number, over, levels in (
        ("families", "distinct(family)", []),
        ("robots", "distinct(robot)", ["family"]),
        ("scenarios", "distinct(scenario)", ["family", "robot"]),
        ("cases", "count()", ["family", "robot", "scenario"]),
    ):
        rows = _joined(rows, [*of_each, *levels], {f"{number}{end}": over})
    rows = rows.transform_calculate(
        **{f"w{end}": f"1/({product})", f"done_w{end}": f"datum.done/({product})"}
    )
    rows = _joined(rows, of_each, {f"rate{end}": f"sum(done_w{end})", f"trials{end}": "count()"})
    rows = _joined(rows, list(within), {f"most_trials{end}": f"max(trials{end})"})
    return rows.transform_calculate(
        **{f"whole{end}": f"datum.trials{end}==datum.most_trials{end}?1:0"}
    )


def _joined(rows: alt.Chart, each: list[Any], aggregates: Mapping[str, Any]) -> alt.Chart:
    """Add aggregates of the rows that agree in some fields to each of them."""
    return rows.transform_joinaggregate(groupby=each, **aggregates)


def comparable(rows: alt.Chart) -> alt.Chart:
    """Weigh rows (see `weighted`) and leave out the laws that did not run every trial of the view.

    Who refuses what is difficult succeeds in the rest: its numbers are of other trials.
    """
    return weighted(rows).transform_filter("datum.whole==1")


def ranked(controls: Sequence[Control], drawn: Sequence[Mapping[str, Any]]) -> alt.Chart:
    """Rank the laws by success, each compared with the best or with the law of `versus`.

    A row per law: rate, trials, whole (whether it ran every case), difference, lower, upper (the
    paired interval: drawn in the first view, else of independent scenarios), tied (not told apart
    from whom it is compared with), place. Who did not run every case has no place, nor has anybody
    where fewer than `FEWEST_SCENARIOS` scenarios count.

    Args:
        controls: of the rows.
        drawn: the intervals of the first view (see `default_intervals`).
    """
    intervals = alt.LookupData(
        alt.InlineData(list(drawn) or [{"contender": ""}]),
        key="contender",
        fields=["drawn_lower", "drawn_upper"],
    )
    return (
        weighted(counted_rows(controls))
        .transform_aggregate(
            s="mean(done)", w="sum(w)", rate="max(rate)", trials="max(trials)", whole="max(whole)",
            groupby=["contender", "family", "robot", "scenario"],
        )
        .transform_joinaggregate(count="distinct(scenario)")
        .transform_calculate(
            against="versus=='best'?datum.whole*10+datum.rate:datum.contender==versus?1:0"
        )
        .transform_window(
            base="first_value(s)", rival="first_value(contender)",
            sort=[alt.SortField("against", "descending"), alt.SortField("contender")],
            groupby=["scenario"], frame=[None, None],
        )
        .transform_calculate(
            d="datum.s-datum.base", shared="versus=='best'||datum.rival==versus?datum.w:0"
        )
        .transform_calculate(shared_d="datum.shared*datum.d")
        .transform_joinaggregate(
            all_shared="sum(shared)", all_shared_d="sum(shared_d)", groupby=["contender"]
        )
        .transform_calculate(difference="datum.all_shared_d/datum.all_shared")
        .transform_calculate(
            v="pow(datum.shared/datum.all_shared*(datum.d-datum.difference),2)"
        )
        .transform_aggregate(
            rate="max(rate)", trials="max(trials)", whole="max(whole)", count="max(count)",
            difference="max(difference)", variance="sum(v)", rival="max(rival)",
            groupby=["contender"],
        )
        .transform_calculate(half=f"{DEVIATIONS}*sqrt(datum.variance)")
        .transform_lookup(lookup="contender", from_=intervals)
        .transform_calculate(is_drawn=f"({is_at_first(controls)})&&isValid(datum.drawn_lower)")
        .transform_calculate(
            lower="datum.is_drawn?datum.drawn_lower:max(-1,datum.difference-datum.half)",
            upper="datum.is_drawn?datum.drawn_upper:min(1,datum.difference+datum.half)",
        )
        .transform_calculate(
            low="max(0,datum.rate+datum.lower-datum.difference)",
            high="min(1,datum.rate+datum.upper-datum.difference)",
            enough=f"datum.count>={FEWEST_SCENARIOS}?1:0",
            rounded="datum.whole*1e7+round(1e6*datum.rate)",
        )
        .transform_calculate(
            tied="datum.whole==1&&datum.enough==1&&datum.rate>0"
            "&&datum.lower<=0&&datum.upper>=0?1:0"
        )
        .transform_joinaggregate(contenders="count()")
        .transform_window(
            rank="rank()", dense="dense_rank()", sort=[alt.SortField("rounded", "descending")]
        )
        .transform_calculate(
            place="datum.whole==0||datum.enough==0||datum.rate==0?null:datum.rank",
            apart="datum.whole==0||datum.enough==0?'':datum.tied==1?'no':'yes'",
        )
        .transform_filter("datum.dense<=toNumber(most)||datum.contender==versus")
    )  # fmt: skip


def matrix(
    controls: Sequence[Control], drawn: Sequence[Mapping[str, Any]], situations: Sequence[str]
) -> Any:
    """Draw laws over situations: a bar of outcomes each, sorted by success (see `ranked`)."""
    by_success = alt.EncodingSortField(field="sorted", op="max", order="descending")
    lines = alt.Axis(ticks=False, domain=False, labelFontSize=12, labelLimit=230, minExtent=175,
                     labelPadding=6, title=None)  # fmt: skip
    scale = alt.Scale(domain=[0, 1.42], nice=False)
    rates = ranked(controls, drawn).transform_calculate(sorted="datum.rounded", zero="0")
    y = alt.Y("contender:N", axis=lines, sort=by_success)
    colour = alt.condition("datum.tied==1", alt.value(TIED), alt.value(OTHER))
    tooltip = [
        NAMED,
        alt.Tooltip("rate:Q", format=".1%", title="success"),
        alt.Tooltip("difference:Q", format="+.1%", title="difference"),
        alt.Tooltip("rival:N", title="to"),
        alt.Tooltip("lower:Q", format="+.1%"),
        alt.Tooltip("upper:Q", format="+.1%"),
        alt.Tooltip("trials:Q"),
        alt.Tooltip("count:Q", title="scenarios"),
    ]
    overall = alt.layer(
        _heading([("Overall", 0.0)], scale),
        rates.mark_rule(strokeWidth=9, opacity=0.35).encode(
            alt.X("zero:Q", scale=scale, axis=None), alt.X2("rate:Q"), y=y, color=colour
        ),
        rates.mark_rule(strokeWidth=2, opacity=0.8).encode(
            alt.X("low:Q", scale=scale, axis=None), alt.X2("high:Q"), y=y, color=colour
        ),
        rates.mark_point(filled=True, size=50, cursor="pointer").encode(
            alt.X("rate:Q", scale=scale, axis=None), y=y, color=colour, tooltip=tooltip
        ),
        rates.transform_calculate(
            text="format(100*datum.rate,'.0f')+' %'+(datum.whole==1?'':' *')"
        )
        .mark_text(align="right", fontSize=12, color="currentColor")
        .encode(
            x=alt.value(OVERALL_PX), y=y, text="text:N",
            opacity=alt.condition("datum.tied==1", alt.value(1), alt.value(0.65)),
        ),
    ).properties(width=OVERALL_PX, height=alt.Step(ROW_PX), name="overall")  # fmt: skip
    return alt.hconcat(
        overall, _situations(controls, situations, by_success), spacing=14
    ).resolve_scale(y="independent", color="independent")


def _situations(controls: Sequence[Control], situations: Sequence[str], by_success: Any) -> Any:
    """Draw the bars of outcomes, and the rate of success at the end of each."""
    scale = alt.Scale(domain=[0, len(situations)], nice=False)
    overall = weighted(counted_rows(controls)).transform_calculate(
        sorted="datum.whole*1e7+round(1e6*datum.rate)"
    )
    shares = (
        weighted(overall, "situation")
        .transform_aggregate(
            share="sum(w_in_situation)", n="count()", trials="max(trials_in_situation)",
            rate="max(rate_in_situation)", sorted="max(sorted)",
            groupby=["contender", "situation", "category"],
        )
        .transform_stack(
            stack="share", as_=["a", "b"], groupby=["contender", "situation"],
            sort=[alt.SortField("category")],
        )
        .transform_calculate(
            column=f"indexof({json.dumps(list(situations))},datum.situation)",
            outcome=f"{json.dumps([each.name for each in CATEGORIES])}[datum.category]",
            negative="-datum.sorted",
        )
        .transform_calculate(
            left=f"datum.column+{BAR_SHARE}*datum.a", right=f"datum.column+{BAR_SHARE}*datum.b"
        )
        .transform_window(dense="dense_rank()", sort=[alt.SortField("negative")])
        .transform_filter("datum.dense<=toNumber(most)||datum.contender==versus")
    )  # fmt: skip
    y = alt.Y("contender:N", axis=None, sort=by_success)
    bars = shares.mark_bar(
        height={"band": 0.72}, cursor="pointer", stroke="currentColor", strokeWidth=0.4,
        strokeOpacity=0.5,
    ).encode(
        alt.X("left:Q", scale=scale, axis=None), alt.X2("right:Q"), y=y,
        color=alt.Color(
            "outcome:N",
            scale=alt.Scale(
                domain=[each.name for each in CATEGORIES], range=[*PALETTE],
            ),
            legend=alt.Legend(
                orient="top", offset=26, title=None, direction="horizontal", labelFontSize=12,
                symbolType="square", columnPadding=12, labelLimit=0,
            ),
        ),
        tooltip=[
            NAMED, alt.Tooltip("situation:N"), alt.Tooltip("outcome:N"),
            alt.Tooltip("share:Q", format=".0%"), alt.Tooltip("n:Q", title="trials"),
            alt.Tooltip("trials:Q", title="of"),
        ],
    )  # fmt: skip
    numbers = (
        shares.transform_aggregate(
            rate="max(rate)", sorted="max(sorted)", groupby=["contender", "situation", "column"]
        )
        .transform_calculate(x="datum.column+0.93", text="format(100*datum.rate,'.0f')")
        .mark_text(align="right", fontSize=11, color="currentColor")
        .encode(
            alt.X("x:Q", scale=scale, axis=None), y=y, text="text:N",
            opacity=alt.condition("datum.rate>0.995", alt.value(1), alt.value(0.65)),
        )
    )  # fmt: skip
    heads = _heading([(each, float(place)) for place, each in enumerate(situations)], scale)
    return alt.layer(bars, numbers, heads).properties(
        width=SITUATION_PX * len(situations), height=alt.Step(ROW_PX), name="matrix"
    )


PALETTE: Final = (
    GOOD, "#6FA8DC", "#F9E7B0", "#E8A33D", BAD, "#4B0082", "#BFC9D1", "#111111",
)  # fmt: skip
"""Colours of `CATEGORIES`, in their order."""


def _heading(texts: Sequence[tuple[str, float]], scale: alt.Scale) -> Any:
    """Write headings above the rows, at their places."""
    data = alt.InlineData([{"text": text, "x": place} for text, place in texts])
    return (
        alt.Chart(data)
        .mark_text(fontSize=11, fontWeight="bold", align="left", baseline="bottom", dy=-5,
                   color="currentColor")
        .encode(alt.X("x:Q", scale=scale, axis=None), y=alt.value(0), text="text:N")
    )  # fmt: skip
