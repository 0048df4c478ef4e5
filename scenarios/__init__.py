"""The scenario families, one per file: parameters -> a Scenario that certifies its own difficulty.

A new family is a file beside these and a line in this table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from dikbench.scenario import Scenario
from scenarios.back_and_forth import back_and_forth
from scenarios.csv_poses import csv_poses
from scenarios.greedy_trap import greedy_trap
from scenarios.hexagon import hexagon
from scenarios.hold_still import hold_still
from scenarios.humanoid import humanoid
from scenarios.joint_limit_approach import joint_limit_approach
from scenarios.joint_limit_crossing import joint_limit_crossing
from scenarios.log_derivative_drift import log_derivative_drift
from scenarios.near_miss import near_miss
from scenarios.obstacle import obstacle
from scenarios.pick_and_place import pick_and_place
from scenarios.reach import reach
from scenarios.self_collision import self_collision
from scenarios.speed_sweep import speed_sweep
from scenarios.start_outside import start_outside
from scenarios.step import step
from scenarios.task_conflict import task_conflict
from scenarios.torque_limited import torque_limited
from scenarios.workspace_boundary import workspace_boundary

SCENARIOS: Mapping[str, Callable[..., Scenario]] = MappingProxyType(
    {
        "reach": reach,
        "step": step,
        "hold-still": hold_still,
        "near-miss": near_miss,
        "joint-limit-crossing": joint_limit_crossing,
        "joint-limit-approach": joint_limit_approach,
        "start-outside": start_outside,
        "greedy-trap": greedy_trap,
        "task-conflict": task_conflict,
        "log-derivative-drift": log_derivative_drift,
        "speed-sweep": speed_sweep,
        "hexagon": hexagon,
        "workspace-boundary": workspace_boundary,
        "torque-limited": torque_limited,
        "obstacle": obstacle,
        "self-collision": self_collision,
        "pick-and-place": pick_and_place,
        "back-and-forth": back_and_forth,
        "humanoid": humanoid,
        "csv": csv_poses,
    }
)
