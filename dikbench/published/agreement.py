"""A formulation beside the inverse that a published package computes."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import msgspec
import numpy as np

from dikbench.errors import DikbenchError
from dikbench.problem.tasks import LinearizedTask
from dikbench.published.measured import Measured, Statistic
from dikbench.published.one_answer import EXACT, answering, random_configurations
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot


class Agreement(msgspec.Struct, frozen=True, tag="agreement", tag_field="protocol"):
    """Velocities of random twists at random configurations, and M V of a package's inverse M(J).

    Attributes:
        module: the package's module.
        maker: the class in it.
        method: its method that turns J into M.
        install: the command that installs the package.
        arguments: of the class.
        robot: see `load_robot`.
        seed: of configurations and twists.
        count: how many.
    """

    module: str
    maker: str
    method: str
    install: str
    arguments: Mapping[str, float] = {}
    robot: str = "panda"
    seed: int = 0
    count: int = 300

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {
            "differing": Statistic(f"states that differ by more than {EXACT:g}", 0),
            "difference": Statistic("largest relative difference", significant=2),
        }
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Compare a formulation's selector with the package.

        Raises:
            DikbenchError: if the package is not installed.
        """
        inverse = self._inverse()
        robot, random = load_robot(self.robot), np.random.default_rng(self.seed)
        kinematics, answer = Kinematics(robot), answering(formulation)
        differences = np.zeros(self.count)
        for k, q in enumerate(random_configurations(robot, self.count, random)):
            kinematics.update(q)
            J, V = kinematics.task_jacobian(), random.normal(size=6)
            theirs = np.asarray(inverse(J)) @ V
            ours = answer(kinematics, 0.01, LinearizedTask(J, V, np.zeros(6)), ())
            differences[k] = np.linalg.norm(ours - theirs) / np.linalg.norm(theirs)
        differing = int((differences > EXACT).sum())
        return {
            "differing": Measured(differing, differing, differing),
            "difference": Measured(float(differences.max())),
        }

    def _inverse(self) -> Any:
        try:
            module = importlib.import_module(self.module)
        except ImportError:
            raise DikbenchError(f"{self.module} is not installed; {self.install}") from None
        return getattr(getattr(module, self.maker)(**self.arguments), self.method)
