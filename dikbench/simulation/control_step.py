"""One control step: the formulation's velocity, or a slowdown where it has no answer."""

from __future__ import annotations

from math import isfinite
from time import perf_counter_ns

import msgspec
import numpy as np

from dikbench.arrays import Array
from dikbench.errors import CannotAnswer, Infeasible, in_words
from dikbench.linear_inequalities import shortest
from dikbench.problem.problem import DikProblem, Formulation
from dikbench.problem.velocity_box import velocity_box
from dikbench.simulation.status import Status
from dikbench.solvers.checked_solve import CheckedSolve

KEPT_RAD_S = 1e-9
"""A row of G v <= h that is passed by less than this [rad/s] is kept."""

FLOATS = np.dtype(float)


class TrialEnded(Exception):
    """An error of a formulation that ends a trial, with the status and the message."""

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.status = status


class StepAnswer(msgspec.Struct, eq=False):
    """The answer to one control step.

    Attributes:
        velocity: the formulation's velocity or the fallback's, (nv,) [rad/s].
        status: `ok`, `infeasible` or `solver-failed` (whether an answer is verified is known after
            the recheck, `stuck` is judged by the motion).
        formulation_ns: time in the formulation, its solver included, rechecking excluded [ns].
        square: v^T v.
    """

    velocity: Array
    status: Status
    formulation_ns: int
    square: float


def control_step(
    formulation: Formulation, problem: DikProblem, solve: CheckedSolve, step: int = 0
) -> StepAnswer:
    """Ask the formulation for the velocity of one step of a run.

    Raises:
        TrialEnded: if the problem is not finite, if the formulation raises another error than
            `CannotAnswer`, or does not return a finite vector (nv,) of real numbers.
    """
    _check_finite(problem)
    solve.begin_step(step)
    start = perf_counter_ns()
    try:
        v = formulation.velocity(problem, solve)
    except CannotAnswer as error:
        formulation_ns = perf_counter_ns() - start - solve.checking_ns
        status = Status.INFEASIBLE if isinstance(error, Infeasible) else Status.SOLVER_FAILED
        v = fallback(problem)
        return StepAnswer(v, status, formulation_ns, float(v.dot(v)))
    except MemoryError as error:
        raise TrialEnded(Status.OUT_OF_MEMORY, f"{type(error).__name__}: {error}") from error
    except Exception as error:
        raise TrialEnded(Status.FORMULATION_ERROR, in_words(error)) from error
    formulation_ns = perf_counter_ns() - start - solve.checking_ns
    return StepAnswer(v, Status.OK, formulation_ns, _square(v, problem.robot.nv))


def _check_finite(problem: DikProblem) -> None:
    """Check that the problem holds numbers alone (h may be infinite): else zeros pass for answers.

    One sum tells almost always, and costs a tenth of asking every entry: a product of what is not
    finite is not finite either, even with zero.
    """
    q, v_prev, G, h = problem.q, problem.v_prev, problem.G, problem.h
    total = float(q.dot(q))  # numpy's own numbers would warn of infinity
    if v_prev is not None:
        total += float(v_prev.dot(v_prev))
    for task in problem.tasks:
        J = task.J
        total += float(np.vdot(J, J)) + float(task.V.dot(task.error))
    if G is not None and h is not None:
        total += float(np.vdot(G, G)) + (np.nan if np.isnan(h).any() else 0.0)
    if isfinite(total):
        return
    parts = {"q": q, "v_prev": v_prev, "G": G, "h": None if h is None else np.minimum(h, 0.0)}
    for number, task in enumerate(problem.tasks, start=1):
        for name in ("J", "V", "error"):
            parts[f"{name} of task {number}"] = getattr(task, name)
    wrong = [n for n, part in parts.items() if part is not None and not np.isfinite(part).all()]
    if wrong:
        raise TrialEnded(
            Status.NOT_FINITE, f"the problem holds NaN or infinity: {', '.join(wrong)}"
        )


def _square(v: object, nv: int) -> float:
    """Check the velocity of a formulation and compute v^T v."""
    if type(v) is not np.ndarray or v.shape != (nv,) or v.dtype is not FLOATS:
        _check_velocity(v, nv)
    square: float = v.dot(v)  # type: ignore[attr-defined]
    # The product is finite if the entries are, which takes a third of checking every entry.
    if not square < np.inf and not np.isfinite(v).all():  # type: ignore[call-overload]
        raise TrialEnded(Status.NOT_FINITE, f"velocity {v.tolist()}")  # type: ignore[attr-defined]
    return square


def _check_velocity(v: object, nv: int) -> None:
    if not isinstance(v, np.ndarray) or v.shape != (nv,):
        shape = getattr(v, "shape", type(v).__name__)
        raise TrialEnded(Status.WRONG_SHAPE, f"expected ({nv},), got {shape}")
    if v.dtype.kind not in "fiu":
        raise TrialEnded(Status.WRONG_SHAPE, f"expected real numbers, got {v.dtype}")


def fallback(problem: DikProblem) -> Array:
    """Slow down uniformly: v = c v_prev, clipped to the velocity box.

    c is the smallest factor in [0, 1] that neither an acceleration limit of a joint forbids,
    1 - min_i a_i dt / |v_prev,i|, nor a row of G v <= h (torques that brake are limited too).
    Without either, or without v_prev, the robot stops at once; outside a position limit the box
    leads it back inside. Where that breaks a row, the nearest velocity in the box that keeps all
    rows is taken; where there is none, the joint limits are kept and rows are broken.
    """
    # Not `problem.box`, which records relaxed bounds as the formulation's.
    box = velocity_box(problem.limits, problem.v_prev, problem.dt)
    v = np.zeros(problem.robot.nv)
    if problem.v_prev is not None:
        v = _slowest(problem, problem.v_prev) * problem.v_prev
    v = np.clip(v, box.lower, box.upper)
    G, h = problem.G, problem.h
    if G is None or h is None or (G @ v <= h + KEPT_RAD_S).all():
        return v
    identity = np.eye(len(v))
    rows, sides = np.vstack([G, identity, -identity]), np.concatenate([h, box.upper, -box.lower])
    bounded = sides < np.inf
    move = shortest(rows[bounded], (sides - rows @ v)[bounded])
    if move is None:
        return v
    nearest: Array = np.clip(v + move, box.lower, box.upper)
    return nearest


def _slowest(problem: DikProblem, v_prev: Array) -> float:
    """Compute the smallest factor c (see `fallback`)."""
    factors = [0.0]
    acceleration = problem.limits.joint.acceleration
    if acceleration is not None:
        slow = np.where(v_prev > 0, -acceleration.lower, acceleration.upper) * problem.dt
        speed = np.abs(v_prev)
        fast = speed > slow  # the others can stop in one step
        factors.extend(1.0 - slow[fast] / speed[fast])
    if problem.G is not None and problem.h is not None:
        change = problem.G @ v_prev
        asking = (change < 0) & (problem.h < 0)  # rows that stopping would break
        factors.extend(problem.h[asking] / change[asking])
    return min(1.0, float(max(factors)))
