"""The contract suites for authors of plug-ins.

`check_formulation(MyLaw())` and `check_family(MyFamily())` run all of them; on the command line,
`dikbench check my_law.py:MyLaw` prints the outcome of each.
"""

from __future__ import annotations

from dikbench.testing.asked import LIMIT_TOLERANCE_RAD_S, Asked
from dikbench.testing.contract import (
    CHECKS,
    Check,
    assert_within,
    check_acceleration_limits,
    check_declaration,
    check_finite,
    check_formulation,
    check_inequalities,
    check_inputs_untouched,
    check_picklable,
    check_position_limits,
    check_raises_only_cannot_answer,
    check_repeatable,
    check_shape,
    check_state,
    check_velocity_limits,
)
from dikbench.testing.family import (
    FAMILY_CHECKS,
    FamilyCheck,
    check_family,
    check_family_certificate,
    check_family_declaration,
    check_family_deterministic,
    check_family_parts,
    check_family_picklable,
    check_family_ranges,
    check_family_seeds,
)
from dikbench.testing.sight import check_sight
from dikbench.testing.states import State, states

__all__ = [
    "CHECKS",
    "FAMILY_CHECKS",
    "LIMIT_TOLERANCE_RAD_S",
    "Asked",
    "Check",
    "FamilyCheck",
    "State",
    "assert_within",
    "check_acceleration_limits",
    "check_declaration",
    "check_family",
    "check_family_certificate",
    "check_family_declaration",
    "check_family_deterministic",
    "check_family_parts",
    "check_family_picklable",
    "check_family_ranges",
    "check_family_seeds",
    "check_finite",
    "check_formulation",
    "check_inequalities",
    "check_inputs_untouched",
    "check_picklable",
    "check_position_limits",
    "check_raises_only_cannot_answer",
    "check_repeatable",
    "check_shape",
    "check_sight",
    "check_state",
    "check_velocity_limits",
    "states",
]
