"""A mobile base that moves freely in the plane."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin


def omnidirectional_base() -> Any:
    """Build a body of 10 kg on a planar joint, without limits.

    Returns:
        A Pinocchio model with nq = 4 (x, y, cos, sin), nv = 3 (body velocity and yaw rate) and the
        frame `base`.
    """
    model = pin.Model()
    model.name = "base"
    joint = model.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "root")
    model.appendBodyToJoint(joint, pin.Inertia.FromSphere(10.0, 0.2), pin.SE3.Identity())
    model.addFrame(pin.Frame("base", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    model.velocityLimit = np.full(3, np.inf)
    return model
