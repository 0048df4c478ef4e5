"""A tracking task and others of the same priority as one task."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dikbench.problem.tasks.task import LinearizedTask, Task, TrackingTask, stacked
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot


@dataclass(frozen=True, eq=False)
class TrackingTogether:
    """A tracking task stacked with tasks of its priority, such as feet that stay in place.

    Attributes:
        tracking: the task whose target moves.
        others: tasks of the same priority.
    """

    tracking: TrackingTask
    others: tuple[Task, ...]

    @property
    def gain(self) -> float:
        """Gain of the tracking task, 1/s."""
        return self.tracking.gain

    @property
    def priority(self) -> int:
        """Priority of the tracking task."""
        return self.tracking.priority

    def rows(self, robot: Robot) -> tuple[int, ...]:
        """Return the rows of the task frame's twist (linear; angular) that are tracked."""
        return self.tracking.rows(robot)

    def linearize(
        self, kinematics: Kinematics, target: Any = None, velocity: Any = None
    ) -> LinearizedTask:
        """See `TrackingTask`."""
        others = [task.linearize(kinematics) for task in self.others]
        return stacked([self.tracking.linearize(kinematics, target, velocity), *others])
