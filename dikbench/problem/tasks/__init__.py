"""Tasks: what a robot is to do; one task per file."""

from dikbench.problem.tasks.centre_of_mass import CentreOfMassTask
from dikbench.problem.tasks.damping import DampingTask
from dikbench.problem.tasks.orientation import OrientationTask
from dikbench.problem.tasks.pose import PoseTask
from dikbench.problem.tasks.position import PositionTask
from dikbench.problem.tasks.posture import PostureTask
from dikbench.problem.tasks.task import LinearizedTask, Task, TrackingTask
from dikbench.problem.tasks.tracking_together import TrackingTogether

__all__ = [
    "CentreOfMassTask",
    "DampingTask",
    "LinearizedTask",
    "OrientationTask",
    "PoseTask",
    "PositionTask",
    "PostureTask",
    "Task",
    "TrackingTask",
    "TrackingTogether",
]
