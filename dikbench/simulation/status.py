"""The outcomes of control steps and trials."""

from __future__ import annotations

from enum import Enum


class Status(Enum):
    """An outcome; its value is its name in tables, its `sentence` explains it."""

    sentence: str

    def __new__(cls, name: str, sentence: str) -> Status:
        """Make a member from its name and its sentence."""
        member = object.__new__(cls)
        member._value_ = name
        member.sentence = sentence
        return member

    OK = ("ok", "The step was answered, or the trial ran to its end.")
    STUCK = ("stuck", "The answer makes less than 1 % of the desired motion.")
    INFEASIBLE = (
        "infeasible",
        "The program has no feasible point; the fallback was applied.",
    )
    SOLVER_FAILED = (
        "solver-failed",
        "The solver gave no answer although a feasible point exists; the fallback was applied.",
    )
    NOT_VERIFIED = (
        "not-verified",
        "The solver claimed success, the recomputed residuals say otherwise.",
    )
    DIVERGED = ("diverged", "The motion left all bounds; the trial was ended.")
    PROTECTIVE_STOP = (
        "protective-stop",
        "The plant stopped the robot at the first limit or distance that was broken.",
    )
    FORMULATION_ERROR = (
        "formulation-error",
        "The formulation raised an error that is not an answer.",
    )
    WRONG_SHAPE = ("wrong-shape", "The formulation did not return a vector of nv numbers.")
    NOT_FINITE = ("not-finite", "The formulation was given or returned NaN or infinity.")
    TIMEOUT = (
        "timeout",
        "The trial ran out of wall-clock time; lower its size or raise the limit.",
    )
    OUT_OF_MEMORY = ("out-of-memory", "The trial asked for more memory than it may have.")
    CRASHED = ("crashed", "The worker process died under the trial.")
    SKIPPED = ("skipped", "The cell cannot work; the message says why.")


STEP_STATUSES = (
    Status.OK,
    Status.STUCK,
    Status.INFEASIBLE,
    Status.SOLVER_FAILED,
    Status.NOT_VERIFIED,
)
"""The outcomes of a step, in the order of their codes in a trace."""

STEP_CODE = {status: code for code, status in enumerate(STEP_STATUSES)}
