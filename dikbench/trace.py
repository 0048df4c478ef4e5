"""What happened in a trial: arrays over its control steps, nothing derived."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from dikbench.array import Array, Indices
from dikbench.status import STEP_CODE, Status


@dataclass(frozen=True, eq=False)
class Trace:
    """The record of a run of n control steps.

    Attributes:
        dt: control period [s].
        q: configurations, (n + 1, nq): before each step, and after the last.
        tau: nominal time on the reference at each of them, (n + 1,) [s].
        wanted: desired twist V of the tracking task, (n, m) [m/s; rad/s], in the task frame.
        commanded: the law's velocity (or the fallback's), (n, nv) [rad/s].
        applied: what the plant made of it, (n, nv) [rad/s].
        status: codes of `STEP_STATUSES`, (n,).
        relaxed: joints whose acceleration bound was given up, (n,).
        claimed, verified: what the solver said of the step's programs and what the recheck says, 1
            or 0; -1 where nothing was solved, (n,) each (see `Verdicts`).
        primal, dual, gap: largest residuals of the step's programs, (n,) (see `Residuals`).
        distance: their largest distance from the optimum, (n,) [rad/s].
    """

    dt: float
    q: Array
    tau: Array
    wanted: Array
    commanded: Array
    applied: Array
    status: Indices
    relaxed: Indices
    claimed: Indices
    verified: Indices
    primal: Array
    dual: Array
    gap: Array
    distance: Array

    @property
    def steps(self) -> int:
        """Number of control steps."""
        return len(self.applied)

    def share(self, status: Status) -> float:
        """Share of the steps with this status; NaN if there was none."""
        if not self.steps:
            return float("nan")
        return float(np.mean(self.status == STEP_CODE[status]))

    def save(self, path: Path) -> None:
        """Write the arrays to a compressed file of numpy's (`.npz`, never pickled)."""
        arrays: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        np.savez_compressed(path, **arrays)

    @classmethod
    def load(cls, path: Path) -> Trace:
        """Read a trace that `save` wrote."""
        with np.load(path, allow_pickle=False) as stored:
            arrays = {field.name: stored[field.name] for field in fields(cls)}
        return cls(**{**arrays, "dt": float(arrays["dt"])})
