"""What a reader must know before believing the tables, generated from the run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import msgspec
import numpy as np
import pandas as pd

from dikbench.arrays import Mask
from dikbench.plugins.finding import plugins
from dikbench.report.sentences.peers_alone import without_counterpart
from dikbench.report.sentences.words import NOT_TIMED, listed, number, quoted, several
from dikbench.scenario.oracle import ORACLE, ORACLES
from dikbench.scenario.plant import PLANTS, REFERENCE_MODES
from dikbench.selector import parse_selector
from dikbench.solvers.catalogue.back_ends import BACK_ENDS, DEFAULT_SOLVER, is_installed
from dikbench.statistics.failures import SKIPPED, has_failed
from dikbench.statistics.stability import STABLE
from dikbench.statistics.trial_matrix import CONTENDER
from dikbench.study.instances import Attempt, instances_among
from dikbench.study.plan import ways_of
from dikbench.study.study import Study
from dikbench.study.trial import NO_SOLVER

FEW_SCENARIOS: Final = 2
"""More scenarios than this (and one) are counted, not listed."""

WORTH_SAYING: Final = 0.01
"""A share of steps above this is remarked upon."""


@dataclass(frozen=True)
class Limitation:
    """Something to keep in mind.

    Attributes:
        text: a sentence.
        cases: where it applies, each a sentence; empty: everywhere.
    """

    text: str
    cases: tuple[str, ...] = ()


def limitations(
    trials: pd.DataFrame,
    manifest: Mapping[str, Any],
    notes: Iterable[str],
    attempts: Sequence[Attempt] = (),
) -> list[Limitation]:
    """Everything to keep in mind.

    Args:
        trials: the rows of trials.csv.
        manifest: the manifest.
        notes: what was found wrong when the results were read.
        attempts: what was drawn for the study.
    """
    found = [Limitation(note) for note in notes]
    found += _missing(trials, manifest, attempts)
    found += _times(trials)
    found += _seeds(trials)
    found += _ways(trials)
    found += _broken(trials)
    found += _steps(trials)
    found += _not_rechecked(trials)
    found += _not_compared(trials)
    found += _not_run(trials)
    return found


def missing(
    trials: pd.DataFrame, manifest: Mapping[str, Any], attempts: Sequence[Attempt] = ()
) -> int:
    """How many trials were planned and have no row."""
    inside = int(in_plan(trials, manifest["study"], attempts).sum())
    return max(0, int(manifest.get("trials", 0)) - inside)


def _missing(
    trials: pd.DataFrame, manifest: Mapping[str, Any], attempts: Sequence[Attempt]
) -> list[Limitation]:
    """Trials without a row, and rows that the last study does not ask for."""
    found = []
    if lacking := missing(trials, manifest, attempts):
        found.append(
            f"The run is not complete: {lacking} of {manifest['trials']} trials are missing; its "
            "command, given again, finishes it."
        )
    if others := int((~in_plan(trials, manifest["study"], attempts)).sum()):
        found.append(
            f"{several(others, 'row')} of earlier runs in this folder, which the last study does "
            "not ask for, are counted with the others."
        )
    return [Limitation(text) for text in found]


def in_plan(
    trials: pd.DataFrame, study: Mapping[str, Any], attempts: Sequence[Attempt] = ()
) -> pd.Series:
    """Which rows the study asks for, given what was drawn; all of them where it does not say."""
    inside = np.zeros(len(trials), dtype=bool)
    for cell in study.get("cells") or [{}]:
        own = {axis: asked for axis in ("scenarios", "plants") if (asked := cell.get(axis))}
        of_cell = np.ones(len(trials), dtype=bool)
        if cell:
            solvers = [*(cell.get("solvers") or DEFAULT_SOLVER.values()), NO_SOLVER.name]
            of_cell = np.asarray(
                trials["formulation"].isin(cell["formulations"]) & trials["solver"].isin(solvers)
            )
        inside[of_cell] |= _asked(trials[of_cell], {**study, **own}, attempts)
    return pd.Series(inside, trials.index)


def _asked(rows: pd.DataFrame, study: Mapping[str, Any], attempts: Sequence[Attempt]) -> Mask:
    """Say which rows of some formulations have the scenario and plant that a study asks for."""
    inside = pd.Series(True, rows.index)
    names = rows["formulation"].map(lambda text: parse_selector(text).name)
    for place, axis in enumerate(("plant", "reference")):
        if asked := study.get(f"{axis}s"):
            wanted = {name: ways_of(name)[place] or asked for name in names.unique()}
            pairs = zip(names, rows[axis], strict=True)
            inside &= pd.Series([value in wanted[name] for name, value in pairs], rows.index)
    if study.get("instances"):
        cells = list(zip(rows["scenario"], rows["seed"], strict=True))
        drawn = instances_among(set(cells), msgspec.convert(study, Study), attempts)
        inside &= pd.Series([cell in drawn for cell in cells], rows.index)
    else:
        for axis in ("scenario", "seed"):
            if asked := study.get(f"{axis}s"):
                inside &= rows[axis].isin(asked)
    return inside.to_numpy()


def _times(trials: pd.DataFrame) -> list[Limitation]:
    if not trials["formulation_time_median_us"].notna().any():
        return [Limitation(f"Nothing is said of speed. {NOT_TIMED}")]
    found = [
        Limitation(
            "Times are of one run on one machine: compare ratios. Solvers are called cold, through "
            "qpsolvers, where their selector names no other interface."
        )
    ]
    cells = trials.drop_duplicates([*CONTENDER, "scenario"])
    cells = cells[cells["timing_stability"].notna()]
    unstable = cells[cells["timing_stability"] != STABLE]
    if len(unstable):
        found.append(
            Limitation(
                f"Of {len(cells)} timed cells {len(unstable)} are not stable (greyed; timing.csv "
                "says why); `dikbench time` takes them anew, on a machine that does nothing else.",
                tuple(
                    sorted(
                        f"{_named(formulation, solver)} on {quoted(scenario)}: {stability}."
                        for (formulation, solver, scenario, stability), _ in _counted(
                            unstable, [*CONTENDER, "scenario", "timing_stability"]
                        )
                    )
                ),
            )
        )
    return found


def _seeds(trials: pd.DataFrame) -> list[Limitation]:
    seeds = sorted(trials["seed"].unique())
    if len(seeds) == 1:
        return [
            Limitation(
                f"There is one seed ({seeds[0]}): intervals are over scenarios and not over seeds, "
                "and small differences between formulations may be those of these scenarios."
            )
        ]
    return []


def _ways(trials: pd.DataFrame) -> list[Limitation]:
    """How the trials were run, and what this does to the numbers."""
    found = []
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
    wall, control = trials["wall_time_s"].sum(), trials["control_time_s"].sum()
    together = int(trials["asked_alone_steps"].notna().sum())
    if together:
        found.append(
            f"{several(together, 'trial')} ran in lockstep, many at a time: the numbers are those "
            "of runs alone but for rounding."
        )
    if wall > 0:
        of = " in trials that ran alone" if together else ""
        found.append(
            f"Of the workers' time{of} {100 * control / wall:.0f} % went into kinematics, laws and "
            "solvers, the rest into the harness (plant, records, recheck, metrics, traces)."
        )
    return [Limitation(text) for text in found]


def _broken(trials: pd.DataFrame) -> list[Limitation]:
    """Cells that were skipped and trials that failed, a case for each reason."""
    found = []
    skipped = trials[trials["status"] == SKIPPED]
    if len(skipped):
        text = f"{several(len(skipped), 'cell')} could not run."
        found.append(Limitation(text, _reasons(skipped, "cell")))
    failed = trials[has_failed(trials)]
    if len(failed):
        text = (
            f"{several(len(failed), 'trial')} failed. Tables count them first; a failed trial "
            "takes the worst value that a metric has."
        )
        found.append(Limitation(text, _reasons(failed, "trial")))
    return found


def _reasons(rows: pd.DataFrame, what: str) -> tuple[str, ...]:
    """Say how often each status and message occurs, with which formulations and scenarios.

    What occurs most often comes first, names in order of the alphabet.
    """
    cases = []
    for (status, message), part in rows.groupby(["status", "message"], sort=False):
        contenders = part[CONTENDER].drop_duplicates().itertuples(index=False, name=None)
        names = listed([_named(*contender) for contender in sorted(contenders)])
        scenarios = sorted(quoted(text) for text in part["scenario"].unique())
        on = listed(scenarios, most=FEW_SCENARIOS)
        text = f"{several(len(part), what)} {status}: {message} ({names}; on {on})."
        cases.append((-len(part), text))
    return tuple(text for _, text in sorted(cases))


def _steps(trials: pd.DataFrame) -> list[Limitation]:
    """Steps that were not answered as they should be, per formulation."""
    found = []
    for column, text in (
        (
            "not_verified_share",
            "Claims of success that the recheck denies: these rows measure the solver.",
        ),
        (
            "infeasible_share",
            "Programs without a feasible point: the fallback slowed the robot down.",
        ),
        (
            "solver_failed_share",
            "Feasible programs without an answer: the fallback slowed the robot down.",
        ),
        (
            "relaxed_share",
            "Acceleration bounds that were given up, where limits contradict one another.",
        ),
    ):
        worst = trials.groupby(CONTENDER)[column].max().reset_index()
        worst = worst.sort_values(column, ascending=False, kind="stable")
        cases = tuple(
            f"{_named(formulation, solver)}: in up to {number(100 * share)} % of a run's steps."
            for formulation, solver, share in worst.itertuples(index=False, name=None)
            if share > WORTH_SAYING
        )
        if cases:
            found.append(Limitation(text, cases))
    return found


def _not_rechecked(trials: pd.DataFrame) -> list[Limitation]:
    """Formulations that had nothing solved, and handed nothing over either."""
    ran = trials[trials["steps"].gt(0) & ~trials["formulation_name"].isin(ORACLES)]
    if ran.empty:
        return []
    checked = ran["verified_share"].notna().groupby(ran["formulation"], sort=False).any()
    names = [quoted(str(name)) for name in checked.index[~checked]]
    text = (
        "Answers that nothing rechecks: no program was handed over. Closed forms have none; one "
        "that solves a program itself can hand it over (`solve.verify`)."
    )
    return [Limitation(text, (f"{listed(names, most=None)}.",))] if names else []


def _not_compared(trials: pd.DataFrame) -> list[Limitation]:
    """Peers whose velocities are compared with nothing."""
    ran = trials.loc[trials["status"] != SKIPPED, "formulation"]
    cases = [
        f"{quoted(peer)}: add {quoted(counterpart)}."
        for peer, counterpart in without_counterpart(list(dict.fromkeys(ran))).items()
    ]
    text = (
        "Other libraries whose velocities are compared with nothing: the formulation of ours that "
        "is to answer alike is not in the run."
    )
    return [Limitation(text, tuple(cases))] if cases else []


def _not_run(trials: pd.DataFrame) -> list[Limitation]:
    """What is registered and no part of the run."""
    ran = trials[trials["status"] != SKIPPED]
    axes = (
        ("formulations", plugins("formulation"), "formulation_name"),
        ("scenario families", plugins("scenario"), "scenario_family"),
        ("solvers", [name for name in BACK_ENDS if is_installed(name)], "solver_name"),
    )
    cases = []
    for what, known, column in axes:
        used = set(ran[column])
        left_out = [name for name in known if name not in used]
        if left_out:
            names = listed([quoted(name) for name in left_out], most=None)
            cases.append(f"{len(left_out)} of {len(known)} {what}: {names}.")
    for column, modes in (("plant_name", PLANTS), ("reference", REFERENCE_MODES)):
        used, what = set(ran[column]), column.removesuffix("_name")
        cases += [f"The {what} `{mode}`." for mode in modes if mode not in used]
    if not trials["formulation"].eq(ORACLE).any():
        cases.append("The oracle, a measure of how well a scenario can be done.")
    return [Limitation("What was not run, and of which nothing is said.", tuple(cases))]


def _named(formulation: str, solver: str) -> str:
    return quoted(formulation) + ("" if solver == "none" else f" with {quoted(solver)}")


def _counted(rows: pd.DataFrame, columns: list[str]) -> list[tuple[tuple[Any, ...], int]]:
    """How many rows share the values of some columns."""
    counts = rows.groupby(columns, sort=False, dropna=False).size().reset_index()
    return [(tuple(key), int(count)) for *key, count in counts.itertuples(index=False, name=None)]
