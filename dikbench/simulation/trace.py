"""The record of a trial: arrays over its control steps, without derived quantities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from dikbench.arrays import Array, Indices
from dikbench.errors import DikbenchError
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.status import STEP_CODE, Status


@dataclass(frozen=True, eq=False)
class Trace:
    """The record of a run of n control steps.

    Attributes:
        dt: control period [s].
        q: configurations before each step and after the last, (n + 1, nq).
        tau: nominal time on the reference at each configuration, (n + 1,) [s].
        wanted: desired twist V of the tracking task, (n, m) [m/s; rad/s], in the task frame.
        commanded: the formulation's velocity (or the fallback's), (n, nv) [rad/s].
        applied: the velocity that the plant applied, (n, nv) [rad/s].
        status: codes of `STEP_STATUSES`, (n,).
        relaxed: joints whose acceleration bound was given up, (n,).
        claimed, verified: the solver's claim about the step's programs and the recheck's result, 1
            or 0; -1 where nothing was solved, (n,) each (see `RecheckedSteps`).
        primal, dual, gap: largest residuals of the step's programs, (n,) (see `Residuals`).
        distance: largest distance of an answer from the optimum, (n,) [rad/s].
        mode: whether the reference advanced with the clock or with the robot along its path.
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
    mode: ReferenceMode = "time"

    @property
    def steps(self) -> int:
        """Number of control steps."""
        return len(self.applied)

    def share(self, status: Status) -> float:
        """Compute the share of the steps with this status; NaN without steps."""
        if not self.steps:
            return float("nan")
        return float(np.mean(self.status == STEP_CODE[status]))

    def save(self, path: Path) -> None:
        """Write the arrays to an Arrow file (LZ4), one column each and a row per control step.

        The last row has the state after the last step only.
        """
        columns = {
            field.name: _column(getattr(self, field.name), self.steps + 1)
            for field in fields(self)
            if field.name in _COLUMNS
        }
        table = pa.table(columns, metadata={"dt": repr(self.dt), "mode": self.mode})
        options = pa.ipc.IpcWriteOptions(compression="lz4")
        with pa.ipc.new_file(str(path), table.schema, options=options) as file:
            file.write_table(table)

    @classmethod
    def load(cls, path: Path) -> Trace:
        """Read a trace that `save` wrote.

        Raises:
            DikbenchError: if the file is not a trace.
        """
        try:
            with pa.ipc.open_file(str(path)) as file:
                table = file.read_all()
            arrays: dict[str, Any] = {name: _array(table.column(name)) for name in _COLUMNS}
            dt = float(table.schema.metadata[b"dt"])
            mode = _mode(table.schema.metadata, arrays["tau"], dt)
        except (OSError, KeyError, TypeError, ValueError) as error:  # with Arrow's own errors
            reason = " ".join(str(error).split())
            raise DikbenchError(f"trace {path}: not a trace of dikbench: {reason}") from None
        n = len(arrays["q"]) - 1
        for name in arrays.keys() - {"q", "tau"}:
            arrays[name] = arrays[name][:n]
        return cls(dt=dt, mode=mode, **arrays)


_COLUMNS = tuple(field.name for field in fields(Trace) if field.name not in {"dt", "mode"})


def _mode(metadata: Mapping[bytes, bytes], tau: Array, dt: float) -> ReferenceMode:
    """What moved the reference on; a trace of version 0.1 does not say, but its tau does."""
    written = metadata.get(b"mode")
    if written is None:
        by_clock = np.array_equal(tau, dt * np.arange(len(tau)))
    else:
        by_clock = written == b"time"
    return "time" if by_clock else "path"


def _column(values: Array | Indices, rows: int) -> Any:
    """Turn an array (k, ...) into a column of at least k rows; missing rows are 0."""
    if len(values) < rows:
        filled = np.zeros((rows, *values.shape[1:]), dtype=values.dtype)
        filled[: len(values)] = values
        values = filled
    flat = pa.array(values.ravel())
    return flat if values.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


def _array(column: Any) -> Any:
    """Turn the column of a table into an array."""
    whole = column.combine_chunks()
    if not pa.types.is_fixed_size_list(whole.type):
        return whole.to_numpy()
    return whole.flatten().to_numpy().reshape(len(whole), whole.type.list_size)
