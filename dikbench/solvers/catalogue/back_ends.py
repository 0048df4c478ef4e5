"""The solvers known by name: what each can solve, and which settings it takes."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

import msgspec

from dikbench.errors import DikbenchError, unknown
from dikbench.programs.quadratic_program import ProgramKind
from dikbench.selector import Selector, parse_selector
from dikbench.solvers.catalogue.back_end import BackEnd, Interface
from dikbench.solvers.catalogue.library import SolverLibrary
from dikbench.solvers.catalogue.plugged import back_end_of, built_library, misfit
from dikbench.solvers.catalogue.presets import (
    REQUESTED_TOLERANCE_SHARE,
    TOLERANCES,
    Preset,
    preset_settings,
)
from dikbench.user_code import Pluggable

_QP_ONLY: Final[frozenset[ProgramKind]] = frozenset({"qp"})
_QP_AND_LP: Final[frozenset[ProgramKind]] = frozenset({"qp", "lp"})

BACK_ENDS: Mapping[str, BackEnd] = MappingProxyType(
    {
        "osqp": BackEnd(
            "operator splitting; Stellato et al. 2020",
            "osqp",
            _QP_AND_LP,
            ("cold", "warm", "cvxpy"),
            {"eps_abs": float, "eps_rel": float, "max_iter": int, "polishing": bool},
        ),
        "clarabel": BackEnd(
            "interior point, homogeneous embedding; Goulart & Chen 2024",
            "clarabel",
            _QP_AND_LP,
            ("cold", "warm", "cvxpy"),
            {"tol_feas": float, "tol_gap_abs": float, "tol_gap_rel": float, "max_iter": int},
        ),
        "piqp": BackEnd(
            "proximal interior point; Schwan et al. 2023",
            "piqp",
            _QP_AND_LP,
            ("cold", "warm"),
            {"eps_abs": float, "eps_rel": float, "max_iter": int},
        ),
        "proxqp": BackEnd(
            "proximal augmented Lagrangian; Bambade et al. 2022",
            "proxsuite",
            _QP_ONLY,
            ("cold", "warm"),
            {"eps_abs": float, "eps_rel": float, "max_iter": int},
            no_lp="through qpsolvers it fails on linear programs",
        ),
        "daqp": BackEnd(
            "dual active set; Arnstrom, Bemporad & Axehill 2022",
            "daqp",
            _QP_AND_LP,
            ("cold", "warm"),
            {"primal_tol": float, "dual_tol": float, "iter_limit": int},
        ),
        "highs": BackEnd(
            "simplex for linear, active set for quadratic programs; Huangfu & Hall 2018",
            "highspy",
            _QP_AND_LP,
            ("cold", "warm", "cvxpy"),
            {
                "primal_feasibility_tolerance": float,
                "dual_feasibility_tolerance": float,
                "qp_iteration_limit": int,
            },
            # Its active-set method cycles endlessly on some semidefinite programs of this size.
            own_defaults=MappingProxyType({"qp_iteration_limit": 1000}),
        ),
        "quadprog": BackEnd(
            "dual active set (GPL, an optional extra); Goldfarb & Idnani 1983",
            "quadprog",
            _QP_ONLY,
            ("cold",),
            {},
            no_lp="it needs a positive definite cost",
        ),
        "scs": BackEnd(
            "operator splitting for cones; O'Donoghue et al. 2016",
            "scs",
            _QP_AND_LP,
            ("cvxpy",),
            {"eps_abs": float, "eps_rel": float, "max_iters": int},
        ),
    }
)

SOLVERS: Final = Pluggable("solver", BACK_ENDS, misfit)
"""Where solvers are looked for: above, then among those of others."""

DEFAULT_SOLVER: Final[Mapping[ProgramKind, str]] = MappingProxyType(
    {"qp": "daqp[then=clarabel]", "lp": "daqp[then=clarabel]", "cvxpy": "clarabel"}
)
"""The solver of a formulation where none is named.

Chosen by `make benchmark-solvers`: 21 329 quadratic and 12 688 linear programs of runs over all
families, with the share of programs that got no answer though they have a feasible point, of steps
whose answers fail the recheck, and the mean time over that of daqp:

    quadratic        no answer  wrong    time     linear           no answer  wrong    time
    daqp             0          0        1        daqp             0.18 %     0.03 %   1
    daqp, warm       0          0.73 %   0.5      daqp, warm       0.18 %     0.04 %   0.5
    piqp             0.01 %     5.6 %    2        piqp             0.67 %     0        2
    clarabel         0          5.3 %    35       clarabel         0.03 %     0        36
    osqp, high       0.39 %     3.1 %    37       osqp, high       0.76 %     0        41
    proxqp           0.31 %     14 %     4
    daqp, clarabel   0          0        1.1      daqp, clarabel   0.02 %     0.03 %   1.1
    daqp, piqp       0          0        1        daqp, piqp       0.17 %     0.03 %   1.1

So daqp first, called cold, since a warm start answers wrongly where a quadratic program is flat;
then clarabel: what daqp does not answer, at singularities and where a joint is outside a limit by
rounding, piqp does not either, nor highs (0.13 %). Presets of daqp are no better (0.14, 0.51 %).
"""


@dataclass(frozen=True)
class Solver:
    """A back end, how it is called, and its settings (those not named are the library's).

    Attributes:
        name: the name of the back end.
        interface: how it is called.
        settings: its settings.
        tolerance: largest residual of a verified answer under its preset.
        then: the solver that is asked where this one gives no answer, under the same preset; None:
            no other.
        library: the one that does not come with dikbench, with its settings.
    """

    name: str
    interface: Interface
    settings: Mapping[str, Any]
    tolerance: float = TOLERANCES["default"]
    then: Solver | None = None
    library: SolverLibrary | None = None


_VALID: Final[Mapping[type, str]] = MappingProxyType(
    {
        bool: "true or false",
        float: "a number, finite and at least 0",
        int: "a whole number, finite and at least 1",
    }
)
"""What a setting may be, by its type."""


def find_back_end(name: str) -> BackEnd:
    """Find a solver by its name, or by `path/to/file.py:Class`.

    Raises:
        DikbenchError: if there is no such solver, or what has the name is none.
    """
    found = SOLVERS.find(name)
    return BACK_ENDS[name] if found is None else back_end_of(found)


def is_installed(name: str) -> bool:
    """Say whether the back end of this name can be imported here; one of another author is."""
    return name not in BACK_ENDS or importlib.util.find_spec(BACK_ENDS[name].package) is not None


def parse_solver(text: str | Selector) -> Solver:
    """Read a selector such as `osqp`, `osqp[preset=high]` or `daqp[interface=warm,then=clarabel]`.

    A setting that is named in addition to a preset replaces the preset's. The solver named by
    `then` has the preset and the interface that are given, and no settings of its own.

    Raises:
        DikbenchError: on an unknown solver, interface, preset or setting, a value of the wrong
            type, a solver that is not installed, or one that is to be asked after itself.
    """
    selector = parse_selector(text)
    back_end = find_back_end(selector.name)
    if not is_installed(selector.name):
        raise DikbenchError(
            f"solver {selector.name!r} is not installed: pip install {back_end.package}"
        )
    parameters = dict(selector.parameters)
    second = parameters.pop("then", None)
    if second == selector.name:
        raise DikbenchError(f"solver {selector}: then names the same solver; valid: another one")
    shared = {k: v for k, v in parameters.items() if k in {"interface", "preset"}}
    interface = parameters.pop("interface", back_end.interfaces[0])
    if interface not in back_end.interfaces:
        raise unknown(f"interface of solver {selector.name}", interface, back_end.interfaces)
    preset: Any = parameters.pop("preset", "default")
    known = presets_of(back_end)
    if preset not in known:
        raise unknown(f"preset of solver {selector.name}", preset, known)
    then = None if second is None else parse_solver(Selector(second, shared))
    if back_end.library is not None:
        eps = REQUESTED_TOLERANCE_SHARE * TOLERANCES[preset]
        asked = None if preset == "default" else eps
        library = built_library(back_end, selector.name, asked, parameters)
        values = {name: getattr(library, name) for name in back_end.settings}
        return Solver(
            selector.name, interface, MappingProxyType(values), known[preset], then, library
        )
    settings = {
        **back_end.own_defaults,
        **preset_settings(selector.name, preset),
        **_settings(back_end, selector, parameters),
    }
    return Solver(selector.name, interface, MappingProxyType(settings), known[preset], then)


def presets_of(back_end: BackEnd) -> Mapping[Preset, float]:
    """Return the presets of a solver, each with the largest residual of a verified answer."""
    if back_end.library is None or back_end.library.has_presets():
        return TOLERANCES
    return {"default": TOLERANCES["default"]}


def why_not(solver: Solver, program: ProgramKind) -> str:
    """Say why this solver, or the one after it, cannot take this kind of program; else empty."""
    reason = _why_not(solver, program)
    return reason if reason or solver.then is None else why_not(solver.then, program)


def _why_not(solver: Solver, program: ProgramKind) -> str:
    back_end = find_back_end(solver.name)
    if program == "cvxpy":
        if solver.interface == "warm":
            return f"{solver.name}[interface=warm] takes matrices, not a formulation in cvxpy"
        if "cvxpy" in back_end.interfaces:
            return ""
        valid = ", ".join(n for n, b in BACK_ENDS.items() if "cvxpy" in b.interfaces)
        return f"{solver.name} is not called through cvxpy here; valid: {valid}"
    if program == "lp" and program not in back_end.programs:
        return f"{solver.name} cannot take a linear program: {back_end.no_lp}"
    return ""


def _settings(
    back_end: BackEnd, selector: Selector, parameters: Mapping[str, str]
) -> Mapping[str, Any]:
    settings = {}
    for key, text in parameters.items():
        if key not in back_end.settings:
            valid = ("interface", "preset", "then", *back_end.settings)
            raise unknown(f"setting of solver {selector.name}", key, valid)
        kind = back_end.settings[key]
        try:
            value: float = msgspec.convert(text, kind, strict=False)
        except msgspec.ValidationError:
            raise DikbenchError(
                f"solver {selector.name}: {key} must be {_VALID[kind]}, got {text!r}"
            ) from None
        least = 1 if kind is int else 0  # a tolerance may be switched off by 0
        if kind is not bool and not least <= value < float("inf"):
            raise DikbenchError(
                f"solver {selector.name}: {key} must be finite and at least {least}, got {text!r}"
            )
        settings[key] = value
    return settings
