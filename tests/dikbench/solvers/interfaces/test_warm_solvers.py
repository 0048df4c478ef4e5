"""Warm solvers: the answers of cold ones, whatever a workspace has seen before."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import product
from typing import Any, Final

import numpy as np
import pytest
from makers.turns import in_turns

from dikbench.arrays import Array
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.back_ends import BACK_ENDS, is_installed, parse_solver
from dikbench.solvers.interfaces.cold import ColdSolver
from dikbench.solvers.interfaces.warm import WarmSolver
from dikbench.solvers.interfaces.warm.warm_solver import WORKSPACES
from dikbench.solvers.recheck.residuals import Residuals, residuals
from dikbench.solvers.recheck.stack import Stack

# The libraries warn beside each failure; `dikbench.solvers` silences them, pytest resets that.
pytestmark = pytest.mark.filterwarnings(r"ignore::UserWarning:qpsolvers\.")

NAMES: Final = [name for name in WORKSPACES if is_installed(name)]
LINEAR: Final = [name for name in NAMES if "lp" in BACK_ENDS[name].programs]

STEPS: Final = 20

LIBRARY_FAILURES: Final = 1
"""Programs of a test at which a library may fail when called cold: HiGHS and ProxQP do, rarely."""

PARTS: Final = ("P", "q", "G", "h", "A", "b", "lb", "ub")

STRUCTURES: Final = {
    "bounds": "b",
    "bounds and equalities": "be",
    "bounds and inequalities": "bi",
    "all": "bei",
    "lower bounds": "l",
    "upper bounds": "u",
    "one-sided bounds": "o",
    "one-sided bounds and all": "oei",
    "infinite bounds and equalities": "xe",
    "inequalities": "i",
    "equalities": "e",
    "infinite sides": "bh",
}
"""Which constraints there are: e(qualities), i(nequalities), h: those of which one has an infinite
side, b(ounds), l(ower), u(pper), o(ne-sided for each x), x: bounds none of which is finite."""

IN_BOUNDS: Final = {name: s for name, s in STRUCTURES.items() if "b" in s}
"""Those in which a linear program has a solution."""


class _Drift:
    """Random programs that vary slowly, a feasible point put into each of them."""

    def __init__(self, structure: str, seed: int, *, linear: bool = False, n: int = 6) -> None:
        self._random = np.random.default_rng([seed, n, len(structure), linear])
        self._structure, self._linear, self._n = structure, linear, n
        m, p = 2, 3
        normal = self._random.normal
        self._parts = {
            "root": normal(size=(n, n)), "q": 2 * normal(size=n), "A": normal(size=(m, n)),
            "G": normal(size=(p, n)), "x": 0.3 * normal(size=n), "room": normal(size=p),
            "lb": normal(size=n), "ub": normal(size=n),
        }  # fmt: skip

    def __iter__(self) -> Iterator[QuadraticProgram]:
        while True:
            yield self._program()
            for part in self._parts.values():
                part += 0.05 * self._random.normal(size=part.shape)

    def take(self, count: int) -> list[QuadraticProgram]:
        """The next programs."""
        return [program for program, _ in zip(self, range(count), strict=False)]

    def _program(self) -> QuadraticProgram:
        n, s, parts = self._n, self._structure, self._parts
        root, x = parts["root"], parts["x"]
        P = np.zeros((n, n)) if self._linear else root.T @ root / n + 0.2 * np.eye(n)
        program = QuadraticProgram((P + P.T) / 2, parts["q"].copy())
        if "e" in s:
            program.A = parts["A"].copy()
            program.b = program.A @ x
        if "i" in s or "h" in s:
            program.G = parts["G"].copy()
            program.h = program.G @ x + 0.2 * np.abs(parts["room"])
            if "h" in s:
                program.h[1] = np.inf
        lower, upper = x - 0.05 - np.abs(parts["lb"]), x + 0.05 + np.abs(parts["ub"])
        if "x" in s:
            lower, upper = np.full(n, -np.inf), np.full(n, np.inf)
        if "o" in s:
            lower[::2], upper[1::2] = -np.inf, np.inf
        if any(c in s for c in "blox"):
            program.lb = lower
        if any(c in s for c in "buox"):
            program.ub = upper
        return program


def _pair(name: str) -> tuple[WarmSolver, ColdSolver, float]:
    """A back end both ways, and what its answers may be off."""
    solver = parse_solver(f"{name}[preset=high]")
    return WarmSolver(solver), ColdSolver(solver), solver.tolerance


def _found(program: QuadraticProgram, answer: Answer) -> Residuals:
    return residuals(Stack([program], [_as_arrays(answer)]))


def _as_arrays(answer: Answer) -> Answer:
    y, z, z_box = (None if v is None else np.asarray(v) for v in (answer.y, answer.z, answer.z_box))
    return Answer(answer.x, answer.claimed, y, z, z_box)


def _is_right(program: QuadraticProgram, answer: Answer, tolerance: float) -> bool:
    """Claimed, and within tolerance with all its multipliers."""
    if not answer.claimed or answer.x is None:
        return False
    found = _found(program, answer)
    known = np.isfinite([found.primal, found.dual, found.gap]).all()
    return bool(known and found.within(tolerance).all())


def _assert_right(
    program: QuadraticProgram, answer: Answer, tolerance: float, expected: Answer | None = None
) -> None:
    """Claimed, within tolerance, its multipliers too, and what is expected."""
    assert answer.claimed
    assert answer.x is not None
    found = _found(program, answer)
    assert np.isfinite([found.primal, found.dual, found.gap]).all(), answer.x
    assert found.within(tolerance), (found.primal, found.dual, found.gap)
    if expected is None:
        return
    assert expected.x is not None
    if program.P.any():
        assert answer.x == pytest.approx(expected.x, rel=0, abs=1e-5)
    else:
        assert program.q @ answer.x == pytest.approx(program.q @ expected.x, rel=0, abs=1e-6)


class _Cold:
    """What the cold interface says, and how often it was wrong itself."""

    def __init__(self, cold: ColdSolver, tolerance: float) -> None:
        self._cold = cold
        self._tolerance = tolerance
        self.failures = 0

    def compare(self, program: QuadraticProgram, answer: Answer) -> None:
        """Where the cold interface is right the warm answer must be, and the same."""
        expected = self._cold(program)
        if _is_right(program, expected, self._tolerance):
            _assert_right(program, answer, self._tolerance, expected)
        else:  # the library's own failure, of which there must not be many
            self.failures += 1
            assert self.failures <= LIBRARY_FAILURES


# --- the same answers as the cold interface's


def _in_turns(names: Iterable[str], structures: Iterable[str]) -> Iterator[Any]:
    """Every solver and structure with two seeds, of which the normal run has one, in turns."""
    for place, (name, structure) in enumerate(product(names, structures)):
        for seed in range(2):
            marks = () if seed == place % 2 else pytest.mark.long
            yield pytest.param(name, structure, seed, marks=marks)


@pytest.mark.parametrize(("name", "structure", "seed"), [*_in_turns(NAMES, STRUCTURES)])
def test_a_drifting_quadratic_program_is_solved_at_every_step(
    name: str, structure: str, seed: int
) -> None:
    """The optimum, which is unique, with its multipliers, as a solver that remembers nothing."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    for program in _Drift(STRUCTURES[structure], seed).take(STEPS):
        reference.compare(program, warm(program, 0))


@pytest.mark.parametrize(("name", "structure", "seed"), [*_in_turns(LINEAR, IN_BOUNDS)])
def test_a_drifting_linear_program_is_solved_at_every_step(
    name: str, structure: str, seed: int
) -> None:
    """The same cost: there may be more than one optimum."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    for program in _Drift(IN_BOUNDS[structure], seed, linear=True).take(STEPS):
        reference.compare(program, warm(program, 0))


@pytest.mark.parametrize("name", NAMES)
def test_a_jump_is_no_harder_than_a_drift(name: str) -> None:
    """Every program has nothing to do with the one before but its structure."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    for seed in range(STEPS):
        program = _Drift("bei", seed).take(1)[0]
        reference.compare(program, warm(program, 0))


@pytest.mark.parametrize("name", LINEAR)
def test_a_cost_may_become_linear_and_quadratic_again(name: str) -> None:
    """At one site: the structure is the same, but for the values of P."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    quadratic, linear = _Drift("bei", 0).take(6), _Drift("bei", 0, linear=True).take(6)
    for both in zip(quadratic, linear, strict=True):
        for program in both:
            reference.compare(program, warm(program, 0))


# --- workspaces


@pytest.mark.parametrize("structures", [("bei", "bei"), ("b", "bei"), ("be", "b")])
@pytest.mark.parametrize("name", NAMES)
def test_two_call_sites_do_not_disturb_each_other(name: str, structures: tuple[str, str]) -> None:
    """With a neighbour at another site, of the same structure or not, and without: the same."""
    first, second = (_Drift(s, k).take(10) for k, s in enumerate(structures))
    together, tolerance = _pair(name)[0], _pair(name)[2]
    alone = _pair(name)[0], _pair(name)[0]
    for programs in zip(first, second, strict=True):
        for site, program in enumerate(programs):
            answer, undisturbed = together(program, site), alone[site](program, site)
            _assert_right(program, answer, tolerance)
            # ProxQP is not the same to the bit: it depends on where its memory is.
            assert answer.x == pytest.approx(undisturbed.x, rel=0, abs=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_the_structure_may_change_at_a_site(name: str) -> None:
    """Bounds, rows and unknowns come and go; every program is solved for what it is."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    for seed, structure in enumerate([*STRUCTURES.values(), *reversed(STRUCTURES.values())]):
        for program in _Drift(structure, seed, n=4 + seed % 3).take(3):
            reference.compare(program, warm(program, 0))


@pytest.mark.parametrize("name", NAMES)
def test_bounds_may_become_finite_and_infinite_again(name: str) -> None:
    """The same structure, since there are bounds all the time."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    for k, program in enumerate(_Drift("bi", 0).take(12)):
        assert program.lb is not None
        assert program.ub is not None
        assert program.h is not None
        if k % 3 == 1:
            program.lb[:4] = -np.inf
            program.ub[2:] = np.inf
            program.h[0] = np.inf
        elif k % 3 == 2:
            program.ub[:] = np.inf
            program.h[1:] = np.inf
        reference.compare(program, warm(program, 0))


def _no_point(program: QuadraticProgram, how: str) -> QuadraticProgram:
    """The same without a feasible point."""
    assert program.G is not None
    assert program.h is not None
    assert program.A is not None
    assert program.b is not None
    assert program.lb is not None
    assert program.ub is not None
    if how == "crossed bounds":
        program.lb = program.ub + 1.0
    elif how == "equality beyond bounds":
        program.b = program.b + 10 * np.abs(program.A).sum() * np.maximum(
            np.abs(program.lb).max(), np.abs(program.ub).max()
        )
    elif how == "inequality beyond bounds":
        program.h = program.h - 10 * np.abs(program.G).sum() * np.maximum(
            np.abs(program.lb).max(), np.abs(program.ub).max()
        )
    else:  # the same row twice with two right-hand sides
        program.A = program.A[[0, 0]]
        program.b = program.b[[0, 0]] + np.array([0.0, 1.0])
    return program


@pytest.mark.parametrize(
    "how",
    ["crossed bounds", "equality beyond bounds", "inequality beyond bounds", "contradiction"],
)
@pytest.mark.parametrize(
    ("name", "linear"), [*((name, False) for name in NAMES), *((name, True) for name in LINEAR)]
)
def test_an_infeasible_program_is_not_claimed_and_forgotten(
    name: str, how: str, linear: bool
) -> None:
    """In the middle of a sequence: what comes after it is solved as if nothing had been."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    programs = _Drift("bei", 0, linear=linear).take(9)
    for k, program in enumerate(programs):
        if k % 3 == 2:
            assert not warm(_no_point(program, how), 0).claimed
        else:
            reference.compare(program, warm(program, 0))


# --- whose arrays are whose


@pytest.mark.parametrize(("name", "structure"), in_turns(NAMES, ["b", "be", "bi", "bei", "oei"]))
def test_an_answer_is_the_callers_own(name: str, structure: str) -> None:
    """Nothing in it changes when the next programs are solved, at its site or elsewhere.

    Nor does the next answer depend on what the caller writes into this one.
    """
    warm, _, tolerance = _pair(name)
    kept: list[tuple[Answer, list[Array | None]]] = []
    for program in _Drift(structure, 0).take(5):
        answer = warm(program, 0)
        _assert_right(program, answer, tolerance)
        kept.append((answer, [_copy(v) for v in _arrays(answer)]))
        warm(program, 1)
    for answer, before in kept:
        for value, was in zip(_arrays(answer), before, strict=True):
            assert (value is None) == (was is None)
            assert value is None or np.array_equal(value, was)  # type: ignore[arg-type]
    for program in _Drift(structure, 1).take(5):
        answer = warm(program, 0)
        _assert_right(program, answer, tolerance)
        for value in _arrays(answer):
            if value is not None:
                value[:] = 1e3


def _arrays(answer: Answer) -> list[Array | None]:
    return [answer.x, answer.y, answer.z, answer.z_box]


def _copy(value: Array | None) -> Array | None:
    return None if value is None else value.copy()


@pytest.mark.parametrize(("name", "structure"), in_turns(NAMES, STRUCTURES))
def test_a_program_is_only_read(name: str, structure: str) -> None:
    """Its arrays are as they were, and may be such that nobody can write to them."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    for k, program in enumerate(_Drift(STRUCTURES[structure], 0).take(8)):
        before = {part: _copy(getattr(program, part)) for part in PARTS}
        if k % 2:
            _freeze(program)
        answer = warm(program, 0)
        reference.compare(QuadraticProgram(**before), answer)  # type: ignore[arg-type]
        for part, was in before.items():
            value = getattr(program, part)
            assert value is None if was is None else np.array_equal(value, was), part


def _freeze(program: QuadraticProgram) -> None:
    for part in PARTS:
        value = getattr(program, part)
        if value is not None:
            value.flags.writeable = False


@pytest.mark.parametrize("name", NAMES)
def test_the_same_arrays_with_other_values_are_another_program(name: str) -> None:
    """A law may write into its arrays from step to step; frozen bounds alone may be remembered."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    for structure in ("b", "bei"):
        kept = _Drift(structure, 0).take(1)[0]
        for program in _Drift(structure, 0).take(8):
            for part in PARTS:
                if getattr(kept, part) is not None:
                    getattr(kept, part)[:] = getattr(program, part)
            reference.compare(kept, warm(kept, 0))


@pytest.mark.parametrize("name", NAMES)
def test_frozen_bounds_come_and_go(name: str) -> None:
    """Away from limits each step has the same two arrays; near them it has its own."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    near, far = _Drift("b", 0).take(12), _Drift("b", 1).take(2)
    for program in far:
        _freeze(program)
    for k, program in enumerate(near):
        if k % 4:
            program.lb, program.ub = far[k // 6].lb, far[k // 6].ub
        reference.compare(program, warm(program, 0))


@pytest.mark.parametrize("order", ["C", "F", "strided"])
@pytest.mark.parametrize("name", NAMES)
def test_the_layout_of_the_matrices_does_not_matter(name: str, order: str) -> None:
    """Rows, columns, or every other number of something larger: a law hands over what it has."""
    warm, cold, tolerance = _pair(name)
    reference = _Cold(cold, tolerance)
    for program in _Drift("bei", 0).take(5):
        parts = {part: _laid_out(getattr(program, part), order) for part in PARTS}
        reference.compare(program, warm(QuadraticProgram(**parts), 0))


def _laid_out(value: Array, order: str) -> Array:
    if order == "strided":
        wide = np.zeros(tuple(2 * size for size in value.shape))
        view: Array = wide[tuple(slice(None, None, 2) for _ in value.shape)]
        view[:] = value
        return view
    return np.array(value, order=order)  # type: ignore[call-overload,no-any-return]
