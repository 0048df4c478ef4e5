"""Data profiles: the share of problems that a formulation solves to each of a ladder of targets.

Where a performance profile compares with the best formulation, a data profile asks for an absolute
error: no formulation's curve depends on the others.

Source: Moré & Wild 2009, Benchmarking derivative-free optimization algorithms; targets in place of
budgets as in Hansen et al. 2021, COCO.
"""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array


def data_profile(errors: Array, targets: Array) -> Array:
    """Compute the share of problems with an error below each target, (targets, formulations).

    Args:
        errors: (problems, formulations); infinite or NaN where a problem was not solved.
        targets: ascending, in the unit of the errors.
    """
    if not len(errors):
        return np.full((len(targets), errors.shape[1]), np.nan)
    shares: Array = np.mean(errors[None] < targets[:, None, None], axis=1)
    return shares
