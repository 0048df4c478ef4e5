"""Print the README's table of findings from the committed tables of `full`.

Each cell is the rate of success in percent with the path that waits, then with the clock, with a ~
where the interval of its difference to the best of those that may be starred holds 0. Of the
formulations with a solver the rows of the default one, daqp, are taken.

    python docs/findings_table.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import pandas as pd

SUCCESS: Final = Path(__file__).parents[1] / "results" / "full" / "tables" / "success.csv"

FORMULATIONS: Final = (
    "pinv", "pinv[after=scale]", "dls[damping=0.05]", "sns", "qp", "lp-alpha",
)  # fmt: skip
"""One of each kind: no limits, scaled, damped, saturated, weighed, slowed down."""

SITUATIONS: Final = {
    "near_singularities": "near singularities",
    "at_joint_limits": "at joint limits",
    "beyond_joint_speed": "beyond joint speed",
    "free_space": "free space",
}

REFERENCES: Final = ("path", "time")
"""Reference modes, in the order in which a cell has them."""

SOLVERS: Final = ("none", "daqp", "daqp[then=clarabel]")
"""Of a formulation without a program, and the default of the others, with or without a stand-in."""


def findings_table() -> str:
    """Write the table in Markdown."""
    rates = pd.read_csv(SUCCESS)
    rates = rates[
        (rates["family"] == "all") & (rates["plant"] == "ideal") & rates["solver"].isin(SOLVERS)
    ].set_index(["formulation", "reference"])
    lines = [
        f"| formulation | {' | '.join(SITUATIONS.values())} |",
        "|---|" + "---:|" * len(SITUATIONS),
    ]
    missing = {*FORMULATIONS} - {*rates.index.get_level_values("formulation")}
    if missing:
        raise SystemExit(f"{SUCCESS}: no row of {', '.join(sorted(missing))}; name others here")
    for name in FORMULATIONS:
        rows = [rates.loc[(name, how)] for how in REFERENCES]
        cells = [" / ".join(_rate(row, key) for row in rows) for key in SITUATIONS]
        lines.append(f"| `{name}` | {' | '.join(cells)} |")
    return "\n".join(lines)


def _rate(row: Any, situation: str) -> str:
    name = f"{situation}_percent"
    tied = float(row[f"{name}_lower"]) <= 0.0 <= float(row[f"{name}_upper"])
    return f"{float(row[name]):.0f}{'~' * tied}"


if __name__ == "__main__":
    print(findings_table())
