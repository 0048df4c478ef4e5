"""Presets: one verified tolerance, expressed in the settings of each solver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final, Literal

Preset = Literal["default", "low", "mid", "high"]

TOLERANCES: Final[Mapping[Preset, float]] = MappingProxyType(
    {"default": 1e-3, "low": 1e-3, "mid": 1e-6, "high": 1e-8}
)
"""The largest residual of a verified answer under each preset: primal in rad/s and m/s, dual and
gap as scaled (see `Residuals`). `default` keeps the library's own settings."""

REQUESTED_TOLERANCE_SHARE: Final = 0.1
"""Share of the tolerance that is set in a solver, which measures residuals in its own scaling."""

HIGHS_SMALLEST_TOLERANCE: Final = 1e-10
"""The smallest tolerance that HiGHS accepts."""

_SETTINGS: Final[Mapping[str, Callable[[float], Mapping[str, Any]]]] = MappingProxyType(
    {
        "osqp": lambda eps: {"eps_abs": eps, "eps_rel": 0.0, "max_iter": 100_000},
        "clarabel": lambda eps: {"tol_feas": eps, "tol_gap_abs": eps, "tol_gap_rel": eps},
        "piqp": lambda eps: {
            "eps_abs": eps,
            "eps_rel": 0.0,
            "eps_duality_gap_abs": eps,
            "eps_duality_gap_rel": 0.0,
        },
        "proxqp": lambda eps: {
            "eps_abs": eps,
            "eps_rel": 0.0,
            "check_duality_gap": True,
            "eps_duality_gap_abs": eps,
            "eps_duality_gap_rel": 0.0,
            "max_iter": 10_000,
        },
        # It is exact except where it smooths a linear program, here more strongly (a negative
        # weight applies only where needed) and to a smaller residual than by default.
        "daqp": lambda eps: {
            "primal_tol": eps / 10,
            "dual_tol": 1e-12,
            "eps_prox": -1e-2,
            "eta_prox": eps / 10,
        },
        "highs": lambda eps: {
            "primal_feasibility_tolerance": max(eps, HIGHS_SMALLEST_TOLERANCE),
            "dual_feasibility_tolerance": max(eps, HIGHS_SMALLEST_TOLERANCE),
            "qp_regularization_value": 0.0,
        },
        "quadprog": lambda eps: {},  # exact, and without settings
        "scs": lambda eps: {"eps_abs": eps, "eps_rel": 0.0, "max_iters": 1_000_000},
    }
)


def preset_settings(solver: str, preset: Preset) -> Mapping[str, Any]:
    """Return the settings of a solver under a preset."""
    if preset == "default":
        return {}
    return _SETTINGS[solver](REQUESTED_TOLERANCE_SHARE * TOLERANCES[preset])
