"""The scenario families, one per file: parameters -> a scenario with a certificate.

A new family is a file in this package and a line in this table.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from dikbench.scenario import Family
from scenarios.back_and_forth import BackAndForth
from scenarios.csv_poses import CsvPoses
from scenarios.greedy_trap import GreedyTrap
from scenarios.hexagon import Hexagon
from scenarios.hold_still import HoldStill
from scenarios.humanoid import Humanoid
from scenarios.joint_limit_approach import JointLimitApproach
from scenarios.joint_limit_crossing import JointLimitCrossing
from scenarios.joint_limit_detour import JointLimitDetour
from scenarios.joint_limit_graze import JointLimitGraze
from scenarios.log_derivative_drift import LogDerivativeDrift
from scenarios.near_miss import NearMiss
from scenarios.obstacle import ObstacleInTheWay
from scenarios.pick_and_place import PickAndPlace
from scenarios.random_joint_path import RandomJointPath
from scenarios.reach import Reach
from scenarios.self_collision import SelfCollision
from scenarios.speed_sweep import SpeedSweep
from scenarios.start_outside import StartOutside
from scenarios.step import Step
from scenarios.task_conflict import TaskConflict
from scenarios.torque_limited import TorqueLimited
from scenarios.workspace_boundary import WorkspaceBoundary

SCENARIOS: Mapping[str, type[Family]] = MappingProxyType(
    {
        "reach": Reach,
        "step": Step,
        "hold-still": HoldStill,
        "near-miss": NearMiss,
        "joint-limit-crossing": JointLimitCrossing,
        "joint-limit-approach": JointLimitApproach,
        "joint-limit-graze": JointLimitGraze,
        "joint-limit-detour": JointLimitDetour,
        "start-outside": StartOutside,
        "greedy-trap": GreedyTrap,
        "task-conflict": TaskConflict,
        "log-derivative-drift": LogDerivativeDrift,
        "random-joint-path": RandomJointPath,
        "speed-sweep": SpeedSweep,
        "hexagon": Hexagon,
        "workspace-boundary": WorkspaceBoundary,
        "torque-limited": TorqueLimited,
        "obstacle": ObstacleInTheWay,
        "self-collision": SelfCollision,
        "pick-and-place": PickAndPlace,
        "back-and-forth": BackAndForth,
        "humanoid": Humanoid,
        "csv": CsvPoses,
    }
)
