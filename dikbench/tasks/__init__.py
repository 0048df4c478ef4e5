"""What can be wanted of a robot: one task per file."""

from dikbench.tasks.centre_of_mass import CentreOfMassTask
from dikbench.tasks.damping import DampingTask
from dikbench.tasks.orientation import OrientationTask
from dikbench.tasks.pose import PoseTask
from dikbench.tasks.position import PositionTask
from dikbench.tasks.posture import PostureTask
from dikbench.tasks.task import LinearizedTask, Task, TrackingTask
from dikbench.tasks.together import TrackingTogether

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
