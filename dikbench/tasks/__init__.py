"""What can be wanted of a robot: one task per file."""

from dikbench.tasks.pose import PoseTask
from dikbench.tasks.posture import PostureTask
from dikbench.tasks.task import LinearizedTask, Task

__all__ = ["LinearizedTask", "PoseTask", "PostureTask", "Task"]
