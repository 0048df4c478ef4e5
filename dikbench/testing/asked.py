"""A formulation asked at the states of the contract, and what it gave."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Final, NamedTuple

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.problem import DikProblem, Formulation, program_of
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.status import Status
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, Solver, parse_solver, why_not
from dikbench.solvers.checked_solve import CheckedSolve, make_solve
from dikbench.testing.cannot_check import CannotCheck
from dikbench.testing.states import State, states

LIMIT_TOLERANCE_RAD_S: Final = 1e-6
"""A limit passed by less than this [rad/s], beyond the residual of the solver, is kept."""


class Answer(NamedTuple):
    """What a formulation gave: a velocity, or None and what it did instead; the solver's residual.

    A formulation may solve several programs, each from what the last one gave: their residuals add
    up.
    """

    velocity: Array | None
    status: Status
    message: str
    residual: float


class Asked:
    """A formulation and the solver with which it is checked; its answers are computed once.

    Raises:
        DikbenchError: if the solver is unknown or cannot take what the formulation needs solved.
    """

    def __init__(self, formulation: Formulation, solver: str | None = None) -> None:
        self.formulation = formulation
        self.selector = solver
        self.program = program_of(formulation)
        self.solver: Solver | None = None
        if self.program is not None:
            self.solver = parse_solver(solver or DEFAULT_SOLVER[self.program])
            reason = why_not(self.solver, self.program)
            if reason:
                raise DikbenchError(reason)

    def states(self) -> Iterator[State]:
        """Yield the states of the contract whose problems the formulation does not refuse."""
        refuses = getattr(self.formulation, "refuses", None)
        return (s for s in states() if refuses is None or not refuses(s.problem))

    def answer(self, problem: DikProblem) -> Answer:
        """Ask the formulation, with a solver that remembers nothing, and recheck the solver."""
        given, solve = self._ask(problem)
        if given.velocity is None:
            return given
        rechecked = solve.rechecked()
        status = Status.NOT_VERIFIED if rechecked.lied[0] else given.status
        residual = solve.calls * float(rechecked.primal[0])
        return Answer(given.velocity.copy(), status, status.sentence, residual)

    def velocity(self, problem: DikProblem) -> Array | None:
        """Ask likewise for the velocity alone, whatever a recheck would say; None: no answer."""
        v = self.velocity_itself(problem)
        return None if v is None else v.copy()

    def velocity_itself(self, problem: DikProblem) -> Array | None:
        """Ask likewise, and return the very array of the formulation."""
        return self._ask(problem)[0].velocity

    def _ask(self, problem: DikProblem) -> tuple[Answer, CheckedSolve]:
        solve = make_solve(self.solver, self.program)
        try:
            answer = control_step(self.formulation, problem, solve)
        except TrialEnded as ended:
            return Answer(None, ended.status, str(ended), 0.0), solve
        none = answer.status in {Status.INFEASIBLE, Status.SOLVER_FAILED}
        velocity = None if none else answer.velocity
        return Answer(velocity, answer.status, answer.status.sentence, 0.0), solve

    @cached_property
    def answers(self) -> list[tuple[State, Answer]]:
        """Ask at every state of the contract, in order."""
        return [(state, self.answer(state.problem)) for state in self.states()]

    def verified(self) -> Iterator[tuple[State, Array, float]]:
        """Yield every state with a verified answer: state, velocity, tolerance [rad/s].

        A formulation may have no answer at some states, and a solver may be wrong at some, but not
        at all of them.
        """
        answered = False
        why = ""
        for state, answer in self.answers:
            if answer.velocity is not None and answer.status is Status.OK:
                answered = True
                yield state, answer.velocity, LIMIT_TOLERANCE_RAD_S + answer.residual
            else:
                why = f"{state.label}: {answer.status.value}: {answer.message}"
        if not answered:
            cause = f"no answer at any state; the last one, {why}"
            raise CannotCheck(cause, cause)


def asked_of(formulation: Formulation | Asked, solver: str | None) -> Asked:
    """Pair a formulation with its solver; one that is paired already stays as it is."""
    return formulation if isinstance(formulation, Asked) else Asked(formulation, solver)
