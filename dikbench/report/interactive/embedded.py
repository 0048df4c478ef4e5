"""What the page embeds to be played: charts, rows and runs, in few bytes."""

from __future__ import annotations

import base64
import gzip
import json
from dataclasses import dataclass
from typing import Any

import pandas as pd

from dikbench.report.interactive.charts import ROWS
from dikbench.report.interactive.page_rows import as_columns, page_rows
from dikbench.report.interactive.replays import make_replays
from dikbench.report.interactive.specification import Charts, bundle, make_charts
from dikbench.report.interactive.trace_charts import trace_charts
from dikbench.viewer.legend import COLOURS, TARGET_COLOUR


@dataclass(frozen=True, eq=False)
class Embedded:
    """What the page embeds.

    Attributes:
        charts: the charts and their controls.
        data: what the page's script reads, JSON that may stand in a page.
        bundle: Vega, a script.
    """

    charts: Charts
    data: str
    bundle: str


def embed(trials: pd.DataFrame) -> Embedded | None:
    """Make what the page embeds of trials; None where none of them counts (see `page_rows`)."""
    if trials["feasible"].fillna("").eq("").all():
        return None
    rows = page_rows(trials)
    if rows.empty:
        return None
    charts, replays = make_charts(rows), make_replays(trials, rows)
    carried = rows["id"].isin(replays["runs"].keys()).astype(int)
    data = {
        "specification": charts.specification,
        "rows": ROWS,
        "columns": packed(as_columns(rows.assign(carried=carried))),
        "tolerances": [text for _, text in charts.controls[0].options],
        "tables": [charts.ranking, charts.trials],
        "replays": packed(replays),
        "traces": trace_charts(),
        "colours": list(COLOURS.values()),
        "path_colour": TARGET_COLOUR,
    }
    return Embedded(charts, in_page(data), bundle().replace("</script", "<\\/script"))


def packed(data: Any) -> str:
    """Write data as JSON, compressed, in base64."""
    text = json.dumps(data, separators=(",", ":"))
    return base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode()


def in_page(data: Any) -> str:
    """Write data as JSON that may stand in an element of a page: nothing in it ends the element."""
    return json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
