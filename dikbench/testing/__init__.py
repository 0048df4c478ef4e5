"""The contract suite for authors of plug-ins: `check_formulation(MyLaw())` runs all of it."""

from __future__ import annotations

from dikbench.testing.contract import (
    CHECKS,
    LIMIT_TOLERANCE_RAD_S,
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
from dikbench.testing.states import State, states

__all__ = [
    "CHECKS",
    "LIMIT_TOLERANCE_RAD_S",
    "Check",
    "State",
    "assert_within",
    "check_acceleration_limits",
    "check_declaration",
    "check_finite",
    "check_formulation",
    "check_inequalities",
    "check_inputs_untouched",
    "check_picklable",
    "check_position_limits",
    "check_raises_only_cannot_answer",
    "check_repeatable",
    "check_shape",
    "check_state",
    "check_velocity_limits",
    "states",
]
