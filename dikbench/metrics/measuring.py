"""The measures of runs: every metric and the outcome, of many runs at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final, NamedTuple

from dikbench.arrays import Array
from dikbench.metrics.every import evaluate
from dikbench.metrics.judging import outcome_columns
from dikbench.metrics.motion import Motion, is_finite
from dikbench.metrics.motion_of_trace import motion_of, motions_of
from dikbench.metrics.plugged import OtherMetric, evaluate_others
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.status import Status
from dikbench.simulation.trace import Trace

STEPS_TOGETHER: Final = 4096
"""The rows of about so many steps are measured together: more of them do not stay in the cache."""


class Measured(NamedTuple):
    """A run to be measured.

    Attributes:
        trace: its record.
        scenario: its case; runs of one and the same scenario are measured together.
        jacobians: see `motion_of`.
        status: how it ended.
    """

    trace: Trace
    scenario: Scenario
    jacobians: Array | None
    status: Status


def measure(runs: Sequence[Measured], others: Sequence[OtherMetric] = ()) -> list[dict[str, Any]]:
    """Compute every metric and the columns of the outcome of each run; none of one without steps.

    They do not depend on what else is measured, to the bit. Metrics of other authors are computed
    in addition (see `evaluate_others`).

    Raises:
        DikbenchError: if a trace is not one of its scenario's robot.
    """
    found: list[dict[str, Any]] = [{} for _ in runs]
    for numbers in _together(runs):
        part = [runs[number] for number in numbers]
        for number, run, motion in zip(numbers, part, _motions(part), strict=True):
            found[number] = {
                **evaluate(motion),
                **evaluate_others(motion, others),
                **outcome_columns(motion, run.status),
            }
    return found


def _motions(runs: Sequence[Measured]) -> list[Motion]:
    """Compute the motions of runs of one scenario, together where there are several."""
    if len(runs) == 1:
        trace, scenario, jacobians, _ = runs[0]
        return [motion_of(trace, scenario, jacobians)]
    jacobians_of_all = [run.jacobians for run in runs]
    return motions_of([run.trace for run in runs], runs[0].scenario, jacobians_of_all)


def _together(runs: Sequence[Measured]) -> Iterator[list[int]]:
    """Group runs with steps by scenario, about `STEPS_TOGETHER` each; one that is not finite alone.

    What is searched for on the path must be finite.
    """
    groups: dict[int, list[int]] = {}
    for number, (trace, scenario, _, _) in enumerate(runs):
        if trace.steps and is_finite(trace):
            groups.setdefault(id(scenario), []).append(number)
        elif trace.steps:
            yield [number]
    for numbers in groups.values():
        part: list[int] = []
        for number in numbers:
            part.append(number)
            if sum(runs[k].trace.steps for k in part) >= STEPS_TOGETHER:
                yield part
                part = []
        if part:
            yield part
