"""The formulations, one per file: (problem, solve) -> velocity.

A new formulation is a file in this package and a line in this table. Other libraries as
formulations are the table `PEERS` of `formulations.peers`.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from dikbench.problem import Formulation
from formulations.alpha_two_stage import AlphaTwoStage
from formulations.condition_governor import ConditionGovernor
from formulations.damped_least_squares import DampedLeastSquares
from formulations.drake import Drake
from formulations.drake_system import DrakeSystem
from formulations.hierarchical_qp import HierarchicalQp
from formulations.jacobian_transpose import JacobianTranspose
from formulations.joint_centering import JointCentering
from formulations.jparse import JParse
from formulations.levenberg_marquardt import LevenbergMarquardt
from formulations.levenberg_marquardt_null_space import LevenbergMarquardtNullSpace
from formulations.lp_alpha import LpAlpha
from formulations.lp_alpha_components import LpAlphaComponents
from formulations.lp_alpha_cvxpy import LpAlphaCvxpy
from formulations.manipulability_damping import ManipulabilityDamping
from formulations.mink_qp import MinkQp
from formulations.neo import Neo
from formulations.nullspace import Nullspace
from formulations.nullspace_robust import NullspaceRobust
from formulations.nullspace_unprojected import NullspaceUnprojected
from formulations.peers import PEERS
from formulations.pink_qp import PinkQp
from formulations.pseudo_inverse import PseudoInverse
from formulations.qp_velocity import QpVelocity
from formulations.selective_damping import SelectiveDamping
from formulations.singular_value_filtering import SingularValueFiltering
from formulations.sns import SaturationInNullSpace
from formulations.sns_fast import FastSaturationInNullSpace
from formulations.sns_margin import SaturationWithScaleMargin
from formulations.sns_optimal import OptimalSaturationInNullSpace
from formulations.truncated_svd import TruncatedSvd
from formulations.variable_damping import VariableDamping
from formulations.virtual_dynamics import VirtualDynamics
from formulations.weighted_least_norm import WeightedLeastNorm
from formulations.weighted_qp import WeightedQp

__all__ = ["FORMULATIONS", "PEERS"]

FORMULATIONS: Mapping[str, type[Formulation]] = MappingProxyType(
    {
        "jacobian-transpose": JacobianTranspose,
        "pinv": PseudoInverse,
        "tsvd": TruncatedSvd,
        "dls": DampedLeastSquares,
        "joint-centering": JointCentering,
        "weighted-least-norm": WeightedLeastNorm,
        "dls-manipulability": ManipulabilityDamping,
        "dls-variable": VariableDamping,
        "lm": LevenbergMarquardt,
        "lm-null-space": LevenbergMarquardtNullSpace,
        "sdls": SelectiveDamping,
        "virtual-dynamics": VirtualDynamics,
        "sv-filter": SingularValueFiltering,
        "jparse": JParse,
        "condition-governor": ConditionGovernor,
        "nullspace": Nullspace,
        "nullspace-robust": NullspaceRobust,
        "nullspace-unprojected": NullspaceUnprojected,
        "sns": SaturationInNullSpace,
        "sns-fast": FastSaturationInNullSpace,
        "sns-optimal": OptimalSaturationInNullSpace,
        "sns-margin": SaturationWithScaleMargin,
        "qp": WeightedQp,
        "qp-velocity": QpVelocity,
        "hqp": HierarchicalQp,
        "pink-qp": PinkQp,
        "mink-qp": MinkQp,
        "lp-alpha": LpAlpha,
        "alpha-two-stage": AlphaTwoStage,
        "drake": Drake,
        "drake-system": DrakeSystem,
        "neo": Neo,
        "lp-alpha-components": LpAlphaComponents,
        "lp-alpha-cvxpy": LpAlphaCvxpy,
    }
)
