"""Comparison of traces."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from dikbench.simulation.trace import Trace


def assert_same_trace(a: Trace, b: Trace) -> None:
    """Assert that two traces are the same to the last bit, with the same types."""
    for field in fields(Trace):
        x, y = np.asarray(getattr(a, field.name)), np.asarray(getattr(b, field.name))
        assert x.dtype == y.dtype, field.name
        assert np.array_equal(x, y, equal_nan=x.dtype.kind == "f"), field.name
