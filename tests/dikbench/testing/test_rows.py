"""The check of formulations that answer many control steps at once, seen to fail."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from dikbench.arrays import Array
from dikbench.errors import DikbenchError, Infeasible
from dikbench.problem import DikProblem, Solve, least_norm, times, transposed
from dikbench.testing.rows import check_rows
from dikbench.testing.straw import STRAW_LAWS


@dataclass(frozen=True)
class OneForAll:
    """Scales all rows by the fastest of them, as code for one row does when it is handed many."""

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """J^+ V, scaled into the velocity limits."""
        v = least_norm(problem.primary.J, problem.primary.V, 1e-6)
        limit = problem.limits.joint.velocity
        return v if limit is None else v / max(1.0, float(limit.usage(v).max()))


@dataclass(frozen=True)
class Other(OneForAll):
    """Is another formulation where it is handed many."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """J^T V, or twice that."""
        v = times(transposed(problem.primary.J), problem.primary.V)
        return v if v.ndim == 1 else 2 * v


@dataclass(frozen=True)
class Remembers(OneForAll):
    """Adds the number of rows, by an amount far below the tolerance."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """J^T V."""
        v = times(transposed(problem.primary.J), problem.primary.V)
        return v if v.ndim == 1 else v + 1e-13 * len(v)


@dataclass(frozen=True)
class OneRow(OneForAll):
    """Answers the first row only."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """J^T V of the first."""
        J, V = problem.primary.J, problem.primary.V
        return J.T @ V if V.ndim == 1 else J[0].T @ V[0]


@dataclass(frozen=True)
class Never(OneForAll):
    """Has no answer for rows."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """J^T V alone."""
        J, V = problem.primary.J, problem.primary.V
        return J.T @ V if V.ndim == 1 else np.full(problem.q.shape[:1] + J.shape[-1:], np.nan)


@dataclass(frozen=True)
class Writes(OneForAll):
    """Changes what it is handed."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """J^T V, V being doubled in passing where there are rows."""
        V = problem.primary.V
        if V.ndim == 2:
            V *= 2
        return times(transposed(problem.primary.J), V)


@dataclass(frozen=True)
class Clips(OneForAll):
    """Has no answer alone where it has one for rows."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """J^T V, inside the limits."""
        v = times(transposed(problem.primary.J), problem.primary.V)
        if v.ndim == 1 and np.abs(v).max() > 0.1:
            raise Infeasible("too fast")
        return v


@dataclass(frozen=True)
class Raises(OneForAll):
    """Does not say whether it is batched."""

    @property
    def batched(self) -> bool:  # type: ignore[override]
        """Raise."""
        raise RuntimeError("no idea")


def test_what_does_not_say_whether_it_is_batched_is_an_error() -> None:
    """In one line, with its class."""
    with pytest.raises(DikbenchError, match=r"class Raises: batched raised RuntimeError: no idea"):
        check_rows(Raises())


@pytest.mark.parametrize(
    ("formulation", "words"),
    [
        (OneForAll(), "rows must not meet"),
        (Other(), "as one of many"),
        (Remembers(), "rows must not meet"),
        (OneRow(), "expected"),
        (Never(), "answered no row"),
        (Writes(), "read-only"),
        (Clips(), "give NaN where there is no answer"),
    ],
    ids=lambda value: type(value).__name__ if not isinstance(value, str) else "",
)
def test_what_is_not_answered_row_by_row_is_named(formulation: OneForAll, words: str) -> None:
    """Each in one line with the state."""
    with pytest.raises(AssertionError, match=words) as caught:
        check_rows(formulation)
    assert "\n" not in str(caught.value).replace("\n ", " ")


def test_who_does_not_claim_it_is_not_asked() -> None:
    """Formulations for one control step are as they were."""
    for law in STRAW_LAWS:
        check_rows(law())
