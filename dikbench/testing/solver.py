"""The contract of solvers, as checks for the author of one.

    @pytest.mark.parametrize("check", dikbench.testing.SOLVER_CHECKS)
    def test_contract(check):
        check(MySolver())

or, without pytest, `check_solver(MySolver())`. The programs are small, seeded, and of the kinds
that formulations pose: bounds, equalities, inequalities, a flat cost, a cost of zero.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import CannotAnswer, DikbenchError, in_words
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.back_ends import Solver, find_back_end
from dikbench.solvers.catalogue.library import SolverLibrary
from dikbench.solvers.catalogue.plugged import misfit
from dikbench.solvers.catalogue.presets import REQUESTED_TOLERANCE_SHARE, TOLERANCES
from dikbench.solvers.checked_solve import CheckedSolve, make_solve
from dikbench.testing.parameters import assert_ranges
from dikbench.testing.programs import (
    Posed,
    infeasible_programs,
    linear_programs,
    programs,
    similar_programs,
)

SolverCheck = Callable[[Solver | SolverLibrary], None]


def solver_of(given: Solver | SolverLibrary) -> Solver:
    """Describe a solver of another author, as if it had been selected; others stay as they are."""
    if isinstance(given, Solver):
        return given
    return Solver(type(given).__name__, "cold", {}, library=given)


def check_solver_declaration(given: Solver | SolverLibrary) -> None:
    """Check that a solver is a frozen dataclass whose numbers have ranges, and pickles."""
    library = given.library if isinstance(given, Solver) else given
    if library is None:
        return
    if wrong := misfit(type(library)):
        raise AssertionError(f"{type(library).__name__} {wrong}")
    if not type(library).__dataclass_params__.frozen:  # type: ignore[attr-defined]
        raise AssertionError(f"write @dataclass(frozen=True) above class {type(library).__name__}")
    assert_ranges(library)
    try:
        pickle.loads(pickle.dumps(library))
    except Exception as error:
        raise AssertionError(
            f"{type(library).__name__} cannot be pickled ({error}); workers are processes"
        ) from error


def check_solver_answers(given: Solver | SolverLibrary) -> None:
    """Check that every feasible program gets an answer that holds by the recheck."""
    solver = solver_of(given)
    _assert_verified(solver, programs())


def check_solver_linear_programs(given: Solver | SolverLibrary) -> None:
    """Check the same of programs without a quadratic cost, where they are promised."""
    solver = solver_of(given)
    if solves_linear(solver):
        _assert_verified(solver, linear_programs())


def check_solver_infeasible(given: Solver | SolverLibrary) -> None:
    """Check that nothing is claimed of programs without a feasible point."""
    solver = solver_of(given)
    for label, program in infeasible_programs():
        answer = _ask(solver).answer(program, 0)
        if answer.claimed:
            raise AssertionError(f"{label}: claimed {answer.x}, though no point is feasible")


def check_solver_inputs_untouched(given: Solver | SolverLibrary) -> None:
    """Check that the arrays of programs stay as they are."""
    solver = solver_of(given)
    for label, program in programs():
        before = {name: np.array(part) for name, part in _parts(program).items()}
        _ask(solver).answer(program, 0)
        for name, part in _parts(program).items():
            if not np.array_equal(before[name], part):
                raise AssertionError(f"{label}: the solver changed {name} of the program")


def check_solver_repeatable(given: Solver | SolverLibrary) -> None:
    """Check that a program gets the same answer to the bit, whatever was solved before it."""
    solver = solver_of(given)
    posed = [*programs()]
    first = [_ask(solver).answer(program, 0) for _, program in posed]
    kept = [None if answer.x is None else np.array(answer.x) for answer in first]
    for (label, program), x, answer in reversed([*zip(posed, kept, first, strict=True)]):
        again = _ask(solver).answer(program, 0)
        if not _same(x, again.x):
            raise AssertionError(f"{label}: gave {x}, asked again {again.x}")
        if not _same(x, answer.x):
            raise AssertionError(f"{label}: gave {x}, which later calls overwrote with {answer.x}")


def check_solver_warm(given: Solver | SolverLibrary) -> None:
    """Check, where there is a workspace, that its answers hold while the program moves on.

    Programs that follow each other as control steps do, then one of another structure at the same
    place, then the first one again.
    """
    solver = solver_of(given)
    if not has_workspace(solver):
        return
    warm = Solver(solver.name, "warm", solver.settings, solver.tolerance, None, solver.library)
    solve = _ask(warm)
    moving = [*similar_programs()]
    answers: list[tuple[str, Answer, Array]] = []
    for number, (label, program) in enumerate([*moving, next(programs()), moving[0]]):
        solve.begin_run(1)
        solve.begin_step(0)
        try:
            x = solve(program)
        except CannotAnswer as error:
            raise AssertionError(f"{label}, program {number} in a row: {error}") from error
        _assert_right(solve, f"{label}, program {number} in a row", warm.tolerance)
        answers.append((label, Answer(x, claimed=True), np.array(x)))
    for label, answer, kept in answers:
        if not _same(answer.x, kept):
            raise AssertionError(f"{label}: later calls overwrote its answer with {answer.x}")


def check_solver_presets(given: Solver | SolverLibrary) -> None:
    """Check, where there are presets, that answers hold to the tolerance of each."""
    solver = solver_of(given)
    library = solver.library
    if library is None or not library.has_presets():
        return
    for name, tolerance in TOLERANCES.items():
        if name == "default":
            continue
        try:
            asked = library.preset(REQUESTED_TOLERANCE_SHARE * tolerance)
            tight = type(library)(**asked)
        except Exception as error:
            said = str(error) if isinstance(error, DikbenchError) else in_words(error)
            raise AssertionError(f"preset={name}: {said}") from error
        changed = Solver(solver.name, "cold", {}, tolerance, None, tight)
        try:
            _assert_verified(changed, programs())
        except AssertionError as error:
            raise AssertionError(f"preset={name}: {error}") from error


def solves_linear(solver: Solver) -> bool:
    """Say whether linear programs are promised."""
    if solver.library is not None:
        return "lp" in solver.library.programs
    return "lp" in find_back_end(solver.name).programs


def has_workspace(solver: Solver) -> bool:
    """Say whether a warm interface is promised."""
    if solver.library is not None:
        return solver.library.has_workspace()
    return "warm" in find_back_end(solver.name).interfaces


def _ask(solver: Solver) -> CheckedSolve:
    return make_solve(solver, "qp")


def _assert_verified(solver: Solver, posed: Iterator[Posed]) -> None:
    for label, program in posed:
        solve = _ask(solver)
        try:
            solve(program)
        except CannotAnswer as error:
            why = _raised(solver, program)
            raise AssertionError(f"{label}: {error}{f' ({why})' if why else ''}") from error
        _assert_right(solve, label, solver.tolerance)


def _raised(solver: Solver, program: QuadraticProgram) -> str:
    """Say what a solver raises where it gives no answer; an empty text where it raises nothing."""
    if solver.library is None:
        return ""
    try:
        answer = solver.library.solve(program)
    except Exception as error:
        return in_words(error)
    return "" if isinstance(answer, Answer) else f"it returned {type(answer).__name__}"


def _assert_right(solve: CheckedSolve, label: str, tolerance: float) -> None:
    found = solve.rechecked()
    if found.lied[0]:
        raise AssertionError(
            f"{label}: claimed an answer that does not hold to {tolerance:g}: primal residual "
            f"{found.primal[0]:.3g}, dual {found.dual[0]:.3g}, gap {found.gap[0]:.3g}, distance "
            f"from the optimum {found.distance[0]:.3g}"
        )


def _parts(program: QuadraticProgram) -> dict[str, Array]:
    parts: dict[str, Any] = {name: getattr(program, name) for name in program.__struct_fields__}
    return {name: part for name, part in parts.items() if part is not None}


def _same(x: Array | None, y: Array | None) -> bool:
    return x is y is None or (x is not None and y is not None and np.array_equal(x, y))


SOLVER_CHECKS: Final[tuple[SolverCheck, ...]] = (
    check_solver_declaration,
    check_solver_answers,
    check_solver_linear_programs,
    check_solver_infeasible,
    check_solver_inputs_untouched,
    check_solver_repeatable,
    check_solver_warm,
    check_solver_presets,
)
"""Every check of a solver: (solver) -> None."""


def check_solver(given: Solver | SolverLibrary) -> None:
    """Run every check; the first one that fails raises `AssertionError`."""
    for check in SOLVER_CHECKS:
        check(given)
