"""Peers, other libraries as formulations, beside the formulations that are to answer alike."""

from __future__ import annotations

import importlib.metadata
from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from dikbench.plugins.building import make_formulation
from dikbench.problem.problem import not_installed, refusal_of
from dikbench.run.timing import Contender, record_run
from dikbench.run.trial_row import TrialRow, scenario_of, solve_of
from dikbench.selector import Selector
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.status import Status
from dikbench.statistics.stability import STABLE
from dikbench.study.trial import NO_SOLVER

SAME_RAD_S: Final = 1e-6
"""Velocities that differ by less are the same."""

NO_REASON: Final = "no reason is known"


def pairs_of(cells: Sequence[Contender]) -> list[tuple[Contender, Contender]]:
    """Pair each installed peer among cells with the cells of its counterpart.

    A peer that has a solver is paired with that solver alone.
    """
    made = [(cell, make_formulation(cell[0])) for cell in cells]
    found = []
    for cell, peer in made:
        counterpart = getattr(peer, "counterpart", "")
        if not counterpart or not_installed(peer):
            continue
        wanted = make_formulation(counterpart)
        found += [
            (cell, other)
            for other, formulation in made
            if formulation == wanted and cell[1] in (NO_SOLVER, other[1])
        ]
    return found


def compare_with_peers(
    selector: Selector, seed: int, pairs: Sequence[tuple[Contender, Contender]]
) -> list[TrialRow]:
    """Ask peers every problem of a run of their counterparts.

    Args:
        selector: the scenario.
        seed: its seed.
        pairs: see `pairs_of`.

    Returns:
        A row for each pair that has steps to be compared (see `dikbench.results.peers`).
    """
    scenario = scenario_of(selector, seed)
    runs = {
        ours: record_run(scenario, make_formulation(ours[0]), solve_of(*ours, checks=False))
        for ours in dict.fromkeys(ours for _, ours in pairs)
    }
    rows = []
    for cell, ours in pairs:
        peer: Any = make_formulation(cell[0])
        if not runs[ours] or refusal_of(peer, runs[ours][0][0]):
            continue
        rows.append(
            {
                "formulation": str(ours[0]),
                "peer": str(cell[0]),
                "scenario": str(selector),
                "solver": str(ours[1]),
                "peer_version": importlib.metadata.version(peer.package),
                **_compared(peer, solve_of(*cell, checks=False), runs[ours]),
            }
        )
    return rows


def _compared(peer: Any, solve: Any, run: Sequence[tuple[Any, Any]]) -> TrialRow:
    """Compare a peer's answers with those of a run."""
    most, steps = np.nan, 0
    differing, silent = Counter[str](), Counter[str]()
    for problem, expected in run:
        if expected is None:
            continue
        try:
            answer = control_step(peer, problem, solve)
        except TrialEnded as ended:
            silent[f"{ended.status.value}: {ended}"] += 1
            continue
        if answer.status is not Status.OK:
            silent[peer.known_difference(problem, None) or NO_REASON] += 1
            continue
        steps += 1
        off = float(np.abs(answer.velocity - expected).max())
        most = np.fmax(most, off)
        if off > SAME_RAD_S:
            differing[peer.known_difference(problem, answer.velocity) or NO_REASON] += 1
    said = [f"{reason} ({count} steps)" for reason, count in differing.items()]
    said += [f"no answer: {reason} ({count} steps)" for reason, count in silent.items()]
    return {
        "steps": steps,
        "velocity_difference_max_rad_s": float(most),
        "explained_by": "; ".join(said),
    }


def with_ticks(rows: Sequence[TrialRow], times: Sequence[TrialRow]) -> list[TrialRow]:
    """Add the medians of whole ticks [us], kinematics included, to rows of one scenario.

    And whether the times of both are stable.

    Args:
        rows: see `compare_with_peers`.
        times: the rows of the timing pass on the scenario.
    """
    ticks: dict[tuple[str, str], tuple[float | None, bool]] = {}
    for row in times:
        if "formulation_time_median_us" in row:
            tick = row["kinematics_time_median_us"] + row["formulation_time_median_us"]
            timed = tick, row["timing_stability"] == STABLE
            ticks[row["formulation"], row["solver"]] = timed
            ticks.setdefault((row["formulation"], ""), timed)
    none = None, False
    found = []
    for row in rows:
        ours = ticks.get((row["formulation"], row["solver"]), none)
        theirs = ticks.get((row["peer"], row["solver"]), ticks.get((row["peer"], ""), none))
        added: TrialRow = {"our_tick_median_us": ours[0], "peer_tick_median_us": theirs[0]}
        if ours[0] is not None and theirs[0] is not None:
            added["ticks_stable"] = float(ours[1] and theirs[1])
        found.append({**row, **added})
    return found
