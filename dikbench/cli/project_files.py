"""The files of a project with one plug-in."""

from __future__ import annotations

from typing import Final

PYPROJECT: Final = """\
[build-system]
requires = ["hatchling>=1.26"]
build-backend = "hatchling.build"

[project]
name = "{name}"
version = "0.1.0"
description = "A {kind} for dikbench"
readme = "README.md"
requires-python = ">=3.11"
dependencies = ["dikbench"]

[project.optional-dependencies]
test = ["pytest>=8"]

[project.entry-points."dikbench.{group}"]
{name} = "{package}"

[tool.hatch.build.targets.wheel]
packages = ["src/{package}"]

[tool.pytest.ini_options]
testpaths = ["tests"]
"""

INIT: Final = """\
\"\"\"What this project registers.\"\"\"

from {package}.{module} import {cls}

{table} = {{"{name}": {cls}}}
"""

FORMULATION: Final = """\
\"\"\"{cls}: a formulation of differential inverse kinematics.\"\"\"

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    Parameters,
    Range,
    Solve,
    damped_least_squares,
)


@dataclass(frozen=True)
class {cls}(Parameters):
    \"\"\"Damped least squares, to begin with: v = J^T (J J^T + damping^2 I)^-1 V.

    Source: the paper that it is from.

    Attributes:
        damping: its damping [m, rad].
    \"\"\"

    damping: Annotated[float, Range(0.0), Drawn(1e-3, 0.3, log=True)] = 0.05

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        \"\"\"Compute the joint velocity of this control step, (nv,) [rad/s or m/s].\"\"\"
        task = problem.primary  # J v = V, in the task frame
        return damped_least_squares(task.J, task.V, self.damping)
"""

FAMILY: Final = """\
\"\"\"{cls}: a family of scenarios.\"\"\"

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pinocchio as pin

from dikbench.scenario import (
    Case,
    Drawn,
    Family,
    Perturbation,
    Range,
    Robot,
    Variation,
    placement_of,
    through,
    usual_claims,
)


@dataclass(frozen=True, kw_only=True)
class {cls}(Family):
    \"\"\"A straight line to the left at a chosen speed, orientation held, to begin with.

    Provokes: little, at low speed

    Shows in: position_error_max_m

    Attributes:
        length: of the line.
        speed: along it.
    \"\"\"

    length: Annotated[float, Range(0.01, 0.5, "m"), Drawn(0.05, 0.3)] = 0.2
    speed: Annotated[float, Range(0.01, 2.0, "m/s"), Drawn(0.05, 0.5, log=True)] = 0.2

    variation = Variation(start=0.1)  # a seed moves each joint of the start by up to 0.1 rad

    def case(self, robot: Robot, change: Perturbation) -> Case:
        \"\"\"Make the reference, the exact joint motion and the claims.\"\"\"
        q0 = change.posture(robot, robot.q0)
        start = placement_of(robot, q0)  # of the task frame
        end = pin.SE3(start.rotation, start.translation + np.array([0.0, self.length, 0.0]))
        reference = through([0.0, self.length / self.speed], [start, end], smooth=False)
        motion = self.exact_motion(robot, reference, q0)  # the joint motion that follows it
        claims = usual_claims(motion, speed=(0.0, 1.0), sigma_min=0.04, margin=0.05)
        return Case(reference, q0, motion, claims)
"""

TEST: Final = """\
\"\"\"The contract of {name}: what dikbench asks of every {kind}.\"\"\"

import pytest
from {package} import {cls}

from dikbench.testing import {checks}


@pytest.mark.parametrize("check", {checks}, ids=lambda check: check.__name__)
def test_contract(check):
    \"\"\"Every clause of the contract holds.\"\"\"
    check({cls}(){more})
"""

README: Final = """\
# {name}

A {kind} for dikbench, in `src/{package}/{module}.py`.

```
dikbench check .                     # from this folder: which promises it keeps
pip install -e ".[test]"
pytest
dikbench run --{option} {name} {other}
```

`src/{package}/__init__.py` holds the table that dikbench reads; more {plural} are more lines there.
"""


def project_files(kind: str, name: str) -> dict[str, str]:
    """Write the files of a project.

    Args:
        kind: `formulation` or `family`.
        name: of the plug-in and the project, such as `my-law`.

    Returns:
        The texts of the files, by their paths.
    """
    package = name.replace("-", "_")
    is_law = kind == "formulation"
    words = {
        "name": name,
        "kind": "formulation" if is_law else "scenario family",
        "plural": "formulations" if is_law else "families",
        "package": package,
        "module": kind,
        "cls": "".join(part.capitalize() for part in name.split("-")),
        "group": "formulations" if is_law else "scenarios",
        "table": "FORMULATIONS" if is_law else "SCENARIOS",
        "checks": "CHECKS" if is_law else "FAMILY_CHECKS",
        "more": ", None" if is_law else "",
        "option": "formulation" if is_law else "scenario",
        "other": "--formulation dls" if is_law else "--formulation dls --formulation qp",
    }
    return {
        "pyproject.toml": PYPROJECT.format(**words),
        f"src/{package}/__init__.py": INIT.format(**words),
        f"src/{package}/{kind}.py": (FORMULATION if is_law else FAMILY).format(**words),
        "tests/test_contract.py": TEST.format(**words),
        "README.md": README.format(**words),
    }
