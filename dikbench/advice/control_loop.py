"""Ten lines of Python that run a formulation in a control loop."""

from __future__ import annotations

from collections.abc import Mapping

LOOP = """import dikbench
import numpy as np
import pinocchio as pin

robot = dikbench.load_robot({robot})
q, v, dt = robot.q0, np.zeros(robot.nv), {dt}  # of your robot: q and v as measured
data = robot.model.createData()
pin.framesForwardKinematics(robot.model, data, q)
target = data.oMf[robot.frame_id].copy()
target.translation[2] -= 0.05  # 5 cm down; here stands your own target
for _ in range(round(3 / dt)):
    answer = dikbench.solve_dik(robot, q, target=target, gain=5.0, dt=dt, v_prev=v,
                                formulation={formulation}{solver})
    q, v = pin.integrate(robot.model, q, answer.velocity * dt), answer.velocity
"""


def control_loop(parameters: Mapping[str, str], dt: float, formulation: str, solver: str) -> str:
    """Write the program.

    Args:
        parameters: of the arm (see `Arm`).
        dt: control period [s].
        formulation: its selector.
        solver: its selector; `none` is left out.
    """
    name, *others = parameters.items()
    options = [repr(name[1]), *(f"{key}={value!r}" for key, value in others)]
    return LOOP.format(
        robot=", ".join(options),
        dt=repr(dt),
        formulation=repr(formulation),
        solver="" if solver == "none" else f", solver={solver!r}",
    )
