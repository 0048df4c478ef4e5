"""The contract suites for authors of plug-ins, one for each kind.

`check_formulation(MyLaw())`, `check_family(MyFamily())`, `check_solver(MySolver())`,
`check_plant(MyPlant())`, `check_robot(MY_ROBOT)` and `check_metric(MY_METRIC)` run all checks of
one; on the command line, `dikbench check my_law.py:MyLaw` prints the outcome of each.
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
from dikbench.testing.direction import check_direction
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
from dikbench.testing.memory import check_memory
from dikbench.testing.metric import METRIC_CHECKS, check_metric
from dikbench.testing.parameters import check_ranges
from dikbench.testing.plant import PLANT_CHECKS, check_plant
from dikbench.testing.priority import check_priority
from dikbench.testing.refusals import check_refusals
from dikbench.testing.robot import ROBOT_CHECKS, check_robot
from dikbench.testing.rows import check_rows
from dikbench.testing.sight import check_sight
from dikbench.testing.solver import SOLVER_CHECKS, check_solver
from dikbench.testing.states import State, states

__all__ = [
    "CHECKS",
    "FAMILY_CHECKS",
    "LIMIT_TOLERANCE_RAD_S",
    "METRIC_CHECKS",
    "PLANT_CHECKS",
    "ROBOT_CHECKS",
    "SOLVER_CHECKS",
    "Asked",
    "Check",
    "FamilyCheck",
    "State",
    "assert_within",
    "check_acceleration_limits",
    "check_declaration",
    "check_direction",
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
    "check_memory",
    "check_metric",
    "check_picklable",
    "check_plant",
    "check_position_limits",
    "check_priority",
    "check_raises_only_cannot_answer",
    "check_ranges",
    "check_refusals",
    "check_repeatable",
    "check_robot",
    "check_rows",
    "check_shape",
    "check_sight",
    "check_solver",
    "check_state",
    "check_velocity_limits",
    "states",
]
