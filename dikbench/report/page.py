"""The report of a results folder: tables, figures, report.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2
import pandas as pd

from dikbench.report.console import to_text
from dikbench.report.figures import draw_figures
from dikbench.report.markdown import markdown_blocks, markdown_rows
from dikbench.report.return_codes import TITLE as RETURN_CODES
from dikbench.report.return_codes import return_codes
from dikbench.report.table_files import write_table
from dikbench.report.table_kinds import KINDS, TIMING
from dikbench.report.tables import make_table
from dikbench.run.results import ResultsFolder
from dikbench.run.stability import STABLE
from dikbench.statistics.problems import LAW

WORTH_SAYING = 0.01
"""A share of steps above this is remarked upon."""


def write_report(path: Path) -> str:
    """Make tables, figures and report.md from trials.csv, the manifest and the traces.

    Returns:
        What is to be printed: the tables over all families and what to keep in mind.

    Raises:
        DikbenchError: if the folder holds no results.
    """
    folder = ResultsFolder(path)
    trials, manifest = folder.read()
    tables = [make_table(kind, trials) for kind in KINDS]
    for table in tables:
        write_table(table, path / "tables")
    shown = [
        {"name": table.name, "title": table.title, "rows": markdown_blocks(table, table.overall)}
        for table in tables
    ]
    codes = return_codes(trials)
    codes.to_csv(path / "tables" / "return_codes.csv", index=False)
    text = markdown_rows(codes) if len(codes) else "Nothing was solved."
    (path / "tables" / "return_codes.md").write_text(f"# {RETURN_CODES}\n\n{text}\n")
    shown.append({"name": "return_codes", "title": RETURN_CODES, "rows": text})
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dikbench.report", ""),
        autoescape=False,  # Markdown, not HTML
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    failed = int((~trials["status"].isin(["ok", "skipped"])).sum())
    skipped = int(trials["status"].eq("skipped").sum())
    told = remarks(trials)
    text = environment.get_template("report.md.j2").render(
        study=manifest["study"],
        manifest=manifest,
        trials=len(trials),
        failed=failed,
        skipped=skipped,
        tables=shown,
        figures=draw_figures(folder, trials, manifest),
        remarks=told,
    )
    (path / "report.md").write_text(text)
    printed = [*map(to_text, tables), f"{RETURN_CODES}\n\n{shown[-1]['rows']}\n"]
    counts = f"{len(trials)} trials, {failed} failed, {skipped} skipped.\n"
    return "\n".join([*printed, counts, *(f"- {remark}" for remark in told)])


def write_times(path: Path) -> str:
    """Make the timing table of a results folder.

    Returns:
        What is to be printed: the table over all scenarios, and which cells are not stable.

    Raises:
        DikbenchError: if the folder holds no results.
    """
    with ResultsFolder(path).open_store() as store:
        times = store.times()
    table = make_table(TIMING, times.assign(status="ok"))
    write_table(table, path / "tables")
    unstable = times[times["timing_verdict"] != STABLE]
    told = [
        f"- {row.formulation} with {row.solver} on {row.scenario}: {row.timing_verdict}."
        for row in unstable.itertuples()
    ]
    return "\n".join([to_text(table), *told])


def remarks(trials: pd.DataFrame) -> list[str]:
    """What a reader must know before believing the tables, generated from the rows."""
    found = []
    if trials["law_time_median_us"].notna().any():
        found.append(
            "Times are of one run on one machine: compare ratios. Solvers are called cold, through "
            "qpsolvers, where their selector names no other interface."
        )
        cells = trials.drop_duplicates([*LAW, "scenario"])["timing_verdict"].dropna()
        unstable = int((cells != STABLE).sum())
        if unstable:
            found.append(
                f"Of {len(cells)} timed cells {unstable} are not stable (timing.csv says why); "
                "`dikbench time` takes them anew, on a machine that does nothing else."
            )
    wall, control = trials["wall_time_s"].sum(), trials["control_time_s"].sum()
    if wall > 0:
        found.append(
            f"Of the workers' time {100 * control / wall:.0f} % went into kinematics, laws and "
            "solvers, the rest into the harness (plant, records, recheck, metrics, traces)."
        )
    if trials["reference"].eq("time").all():
        found.append(
            "The reference moved on with the clock: laws that slow down fall behind by design. "
            "Run with `--reference path` to let it wait for them."
        )
    found.append(
        "A scenario without a path (a step) starts with its full error, which is then its largest: "
        "see position_error_final_m."
    )
    found.append(
        "Where a solver is far from the optimum its row measures the solver, not the law; a wrong "
        "answer can look better than the right one."
    )
    skipped = trials[trials["status"] == "skipped"]
    for formulation, solver, message, number in _counted(skipped, [*LAW, "message"]):
        found.append(f"{formulation} with {solver}: {_several(number, 'cell')} skipped: {message}.")
    failed = trials[~trials["status"].isin(["ok", "skipped"])]
    for formulation, solver, status, message, number in _counted(
        failed, [*LAW, "status", "message"]
    ):
        found.append(
            f"{formulation} with {solver}: {_several(number, 'trial')} {status}: {message}."
        )
    for column, words in (
        ("not_verified_share", "claimed success that the recheck denies"),
        ("solver_failed_share", "gave no answer to a feasible program"),
        ("relaxed_share", "had to give up an acceleration bound"),
    ):
        worst = trials.groupby(LAW, sort=False)[column].max().reset_index()
        for formulation, solver, share in worst.itertuples(index=False, name=None):
            if share > WORTH_SAYING:
                percent = f"{100 * share:.0f} %"
                found.append(
                    f"{formulation} with {solver} {words} in up to {percent} of a run's steps."
                )
    return found


def _several(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _counted(rows: pd.DataFrame, columns: list[str]) -> list[tuple[Any, ...]]:
    """How many rows share the values of some columns, the number last."""
    counts = rows.groupby(columns, sort=False).size().reset_index()
    return list(counts.itertuples(index=False, name=None))
