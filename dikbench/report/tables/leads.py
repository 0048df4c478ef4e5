"""What the highest rates of success hang on: a robot, a family, a parameter of all scenarios."""

from __future__ import annotations

from itertools import compress
from pathlib import Path

import numpy as np
import pandas as pd

from dikbench.report.selection.judged import DEFINITIONS, SETTINGS, judged_rows, rows_of_all
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.first_places import dependable, told_of, too_few
from dikbench.statistics.leaving_out import WithoutOne, without_each
from dikbench.statistics.rank_agreement import rank_agreement
from dikbench.statistics.success import rates, succeeded


def leads_table(trials: pd.DataFrame) -> pd.DataFrame:
    """Make a row per setting and situation with all cases, and one for each that is left out.

    Only candidates lead (see `dependable`); situations of too few scenarios have no rows. `stays`
    says whether one of those who lead leads with all cases, too.

    Args:
        trials: the rows of trials.csv.
    """
    of_setting = {setting: judged_rows(trials, setting) for setting in SETTINGS}
    every = rows_of_all(of_setting)
    lines = []
    for setting, rows in of_setting.items():
        candidates = dependable(rows, every)
        for situation in DEFINITIONS:
            part = rows[rows["situation"].eq(situation)]
            if part.empty or too_few(part):
                continue
            found = rates(part, succeeded(part))
            contenders = list(found.contenders.itertuples(index=False, name=None))
            names = [
                f"{name} with {solver}".removesuffix(" with none") for name, solver in contenders
            ]
            may_be = told_of(part, candidates)
            rivals = np.array([each in may_be for each in contenders]) & found.whole
            layout = found.layout
            whole = WithoutOne(
                "", "", len(layout.cases), layout.cases["scenario"].nunique(), found.rate
            )
            with_all = whole.leaders(rivals)
            for each in (whole, *without_each(part, found)):
                leaders = each.leaders(rivals)
                lines.append(
                    {
                        "setting": setting,
                        "situation": situation,
                        "left_out": each.kind,
                        "name": each.name,
                        "cases": each.cases,
                        "leaders": "; ".join(compress(names, leaders)),
                        "success_percent": 100 * float(each.rate[leaders].max(initial=0.0)),
                        "stays": bool((leaders & with_all).any()),
                    }
                )
    return pd.DataFrame(lines)


def rank_agreement_table(trials: pd.DataFrame) -> pd.DataFrame:
    """Make a row per setting, parameter and value (see `rank_agreement`), oracles left out.

    Args:
        trials: the rows of trials.csv.
    """
    contenders = trials[~trials["formulation"].isin(ORACLES)]
    found = {setting: rank_agreement(judged_rows(contenders, setting)) for setting in SETTINGS}
    return pd.concat(found, names=["setting", ""]).reset_index("setting")


def write_leads(trials: pd.DataFrame, folder: Path) -> None:
    """Write leads.csv and rank_agreement.csv, if there are rows."""
    tables = {"leads": leads_table(trials), "rank_agreement": rank_agreement_table(trials)}
    for name, table in tables.items():
        if len(table):
            folder.mkdir(exist_ok=True)
            table.to_csv(folder / f"{name}.csv", index=False, float_format="%.4g")
