"""The control laws, one per file: (problem, solve) -> velocity.

A new law is a file beside these and a line in this table.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from dikbench.problem import Formulation
from formulations.condition_governor import ConditionGovernor
from formulations.damped_least_squares import DampedLeastSquares
from formulations.jacobian_transpose import JacobianTranspose
from formulations.jparse import JParse
from formulations.levenberg_marquardt import LevenbergMarquardt
from formulations.lp_alpha import LpAlpha
from formulations.lp_alpha_cvxpy import LpAlphaCvxpy
from formulations.manipulability_damping import ManipulabilityDamping
from formulations.nullspace import Nullspace
from formulations.pseudo_inverse import PseudoInverse
from formulations.selective_damping import SelectiveDamping
from formulations.singular_value_filtering import SingularValueFiltering
from formulations.truncated_svd import TruncatedSvd
from formulations.variable_damping import VariableDamping
from formulations.weighted_qp import WeightedQp

FORMULATIONS: Mapping[str, type[Formulation]] = MappingProxyType(
    {
        "jacobian-transpose": JacobianTranspose,
        "pinv": PseudoInverse,
        "tsvd": TruncatedSvd,
        "dls": DampedLeastSquares,
        "dls-manipulability": ManipulabilityDamping,
        "dls-variable": VariableDamping,
        "lm": LevenbergMarquardt,
        "sdls": SelectiveDamping,
        "sv-filter": SingularValueFiltering,
        "jparse": JParse,
        "condition-governor": ConditionGovernor,
        "nullspace": Nullspace,
        "qp": WeightedQp,
        "lp-alpha": LpAlpha,
        "lp-alpha-cvxpy": LpAlphaCvxpy,
    }
)
