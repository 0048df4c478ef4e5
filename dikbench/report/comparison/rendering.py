"""A comparison in words and tables: Markdown that reads as text."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.report.comparison.comparison import Comparison
from dikbench.report.comparison.gate import SOLVER_FAILED
from dikbench.report.comparison.matching import trial_name
from dikbench.report.selection.judged import IN_WORDS
from dikbench.report.sentences.words import several
from dikbench.report.tables.markdown import escape, markdown_rows
from dikbench.results.columns import TRIAL
from dikbench.statistics.failures import SKIPPED

ON_CONSOLE: Final = 20
"""So many rows of a list are printed; a file holds all."""


def render(comparison: Comparison, rows: int | None = ON_CONSOLE) -> str:
    """Write the comparison as Markdown: the verdict in the first line, then regressions first.

    Args:
        comparison: what is shown.
        rows: of each list, at most so many; None: all.
    """
    parts = [
        _verdict(comparison),
        f"# {comparison.a} (A) and {comparison.b} (B)",
        _summary(comparison),
        *_statuses(comparison, rows),
        *_solvers(comparison, rows),
        *_success(comparison, rows),
        *_metrics(comparison, rows),
        *_times(comparison, rows),
        *_alone(comparison, rows),
        *_versions(comparison),
    ]
    return "\n\n".join(parts)


def write(comparison: Comparison, file: Path) -> None:
    """Write a comparison: `.md`, the text with every row; `.csv`, every difference of every trial.

    Raises:
        DikbenchError: on another ending, or a file that cannot be written.
    """
    if file.suffix == ".md":
        text = render(comparison, None) + "\n"
    elif file.suffix == ".csv":
        text = comparison.trials().to_csv(index=False)
    else:
        raise DikbenchError(f"file {file}: valid endings: .md, .csv")
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise DikbenchError(f"file {file}: {error.strerror or error}") from None


def _verdict(comparison: Comparison) -> str:
    """Say in one line whether B passes."""
    if comparison.regressed:
        return f"REGRESSED: {'; '.join(comparison.breaches)}."
    if comparison.guarded:
        return f"Within tolerance{': no difference' if comparison.nothing_differs else ''}."
    if comparison.nothing_differs:
        return "No difference."
    return "B differs from A; without --tolerance nothing is judged."


def _summary(comparison: Comparison) -> str:
    matched, formulations = comparison.matched, comparison.formulations
    skipped = matched.a["status"].eq(SKIPPED) & matched.b["status"].eq(SKIPPED)
    both, ok = int((~skipped).sum()), int(matched.both_ok.sum())
    told = [f"{several(both, 'trial')} in both, of which {ok} ended ok in both."]
    if skipped.any():
        told.append(f"{several(int(skipped.sum()), 'cell')} skipped in both.")
    if len(matched.status_changes):
        told.append(
            f"{len(matched.status_changes)} changed their status, {matched.newly_failed} to the "
            "worse."
        )
    if formulations.empty:
        told.append("No metric differs by more than rounding.")
    else:
        told.append(
            f"Of the metrics {int((formulations['worse'] > 0).sum())} became worse in a trial and "
            f"{int((formulations['worse'] == 0).sum())} in none."
        )
    return " ".join(told)


def _solvers(comparison: Comparison, rows: int | None) -> list[str]:
    matched = comparison.matched
    newly = matched.solver_newly_fails
    if not newly.any():
        return []
    shares = matched.a[TRIAL].assign(
        before=matched.a[SOLVER_FAILED].fillna(0.0), after=matched.b[SOLVER_FAILED]
    )[newly]
    shares = shares.loc[(shares["before"] - shares["after"]).sort_values(kind="stable").index]
    lines = [
        f"- {100 * row['before']:.3g} -> {100 * row['after']:.3g} % of the steps without an "
        f"answer: {escape(trial_name(row))}"
        for row in _records(shares.head(_most(rows, shares)))
    ]
    return ["## Solvers that newly fail", "\n".join([*lines, *_more(rows, shares)])]


def _success(comparison: Comparison, rows: int | None) -> list[str]:
    found = comparison.success
    if found.empty or not found[["lost", "gained"]].to_numpy().any():
        return []
    moved = found[found["lost"].gt(0) | found["gained"].gt(0)]
    moved = moved.iloc[(moved["rate_b"] - moved["rate_a"]).argsort(kind="stable")]
    head = moved.head(_most(rows, moved))
    table = pd.DataFrame(
        {
            "formulation": head["formulation"],
            "solver": head["solver"],
            "plant": head["plant"],
            "setting": [IN_WORDS[setting] for setting in head["setting"]],
            "A %": (100 * head["rate_a"]).map(_number),
            "B %": (100 * head["rate_b"]).map(_number),
            "lost/gained/trials": [
                f"{row['lost']}/{row['gained']}/{row['trials']}" for row in _records(head)
            ],
        }
    )
    return ["## Success", "\n".join([markdown_rows(table), *_more(rows, moved)])]


def _statuses(comparison: Comparison, rows: int | None) -> list[str]:
    changes = comparison.matched.status_changes
    if changes.empty:
        return []
    lines = [
        f"- {row['status_a']} -> {row['status_b']}: {escape(trial_name(row))}"
        + (f": {escape(row['message_b'])}" if row["message_b"] else "")
        for row in _records(changes.head(_most(rows, changes)))
    ]
    return ["## Status", "\n".join([*lines, *_more(rows, changes)])]


def _metrics(comparison: Comparison, rows: int | None) -> list[str]:
    formulations = comparison.formulations
    if formulations.empty:
        return []
    head = formulations.head(_most(rows, formulations))
    columns = {
        "metric": head["metric"],
        "formulation": head["formulation"],
        "solver": head["solver"],
        "plant": head["plant"],
        "reference": head["reference"],
        "beyond": head["beyond"],
        "worse/better/trials": [
            f"{row['worse']}/{row['better']}/{row['trials']}" for row in _records(head)
        ],
        "mean A": head["mean_a"].map(_number),
        "mean B - A": head["mean_difference"].map(_signed),
        "95 % interval of B - A": [_interval(row["low"], row["high"]) for row in _records(head)],
        "worst B - A": head["worst_difference"].map(_signed).where(head["worse"] > 0, ""),
        "in": [
            f"{row['scenario']} seed {row['seed']}" if row["worse"] else ""
            for row in _records(head)
        ],
    }
    if not comparison.guarded:
        del columns["beyond"]
    return [
        "## Metrics",
        "\n".join([markdown_rows(pd.DataFrame(columns)), *_more(rows, formulations)]),
    ]


def _times(comparison: Comparison, rows: int | None) -> list[str]:
    times = comparison.times
    if times.empty:
        return []
    times = times.sort_values("ratio", ascending=False)
    head = times.head(_most(rows, times))
    table = pd.DataFrame(
        {
            "formulation": head["formulation"],
            "solver": head["solver"],
            "scenarios": head["scenarios"],
            "median, B over A": head["ratio"].map(_number),
            "95 % interval of the median": [
                _interval(row["low"], row["high"], _number) for row in _records(head)
            ],
            "p99, B over A": head["p99_ratio"].map(_number),
            "unstable": head["unstable"],
        }
    )
    told = ["Ratios of the formulation's time with its solver, geometric mean over scenarios."]
    if not comparison.same_machine:
        told.append("The machines differ: these ratios say nothing of the code alone.")
    unstable, cells = int(times["unstable"].sum()), int(times["scenarios"].sum())
    if unstable:
        told.append(f"Of {cells} cells {unstable} were not stable in A or in B.")
    return ["## Times", " ".join(told), "\n".join([markdown_rows(table), *_more(rows, times)])]


def _alone(comparison: Comparison, rows: int | None) -> list[str]:
    matched, lines = comparison.matched, []
    for name, alone in (("A", matched.only_a), ("B", matched.only_b)):
        if len(alone):
            count = "1 trial is" if len(alone) == 1 else f"{len(alone)} trials are"
            lines.append(f"{count} in {name} only:\n")
            head = alone.head(_most(rows, alone))
            lines += [f"- {escape(trial_name(row))}" for row in _records(head)]
            lines += [*_more(rows, alone), ""]
    lines += [f"{text}." for text in matched.unmatched_columns]
    return ["## Not compared", "\n".join(lines).strip()] if lines else []


def _versions(comparison: Comparison) -> list[str]:
    told = []
    if comparison.matched.other_ids:
        told.append(
            f"{comparison.matched.other_ids} of the trials in both have another id: the source of "
            "their formulation or of their scenario differs."
        )
    if comparison.versions:
        table = pd.DataFrame(comparison.versions, columns=["what", "A", "B"])
        told.append(markdown_rows(table))
    return ["## Versions", *told] if told else []


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def _most(rows: int | None, table: pd.DataFrame) -> int:
    return len(table) if rows is None else rows


def _more(rows: int | None, table: pd.DataFrame) -> list[str]:
    left = len(table) - _most(rows, table)
    return [f"\n... and {left} more (--out FILE.md has them)"] if left > 0 else []


def _number(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.4g}"


def _signed(value: float) -> str:
    return "undefined" if math.isnan(value) else f"{value:+.3g}"


def _interval(low: float, high: float, shown: Callable[[float], str] = _signed) -> str:
    """Both ends; empty where one trial says nothing of others."""
    return "" if math.isnan(low) else f"{shown(low)} to {shown(high)}"
