"""Where the target of a scenario is."""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array
from dikbench.scenario.scenario import Scenario
from dikbench.viewer.moving_joints import wxyz


def target_poses(scenario: Scenario, tau: Array) -> Array:
    """Compute poses of the target at nominal times (k,) [s], as `Scenario.target` does, (k, 7).

    Each is a position [m] and a quaternion w, x, y, z; a reference that moves rests at its end.
    """
    reference = scenario.reference
    if reference.moving:
        tau = np.minimum(tau, reference.duration)
    rotations, translations = reference.placements(tau)
    return np.array([[*at, *wxyz(R)] for at, R in zip(translations, rotations, strict=True)])
