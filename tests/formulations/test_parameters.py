"""The parameters of laws are checked when the law is made."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import numpy as np
import pytest

from dikbench import DikbenchError
from dikbench.plugins.building import make_formulation

NOT_NEGATIVE = [
    ("pinv", "rank_tolerance"),
    ("dls", "damping"),
    ("qp", "damping"),
    ("lp-alpha", "regularization"),
    ("joint-centering", "gain"),
    ("joint-centering", "rank_tolerance"),
    ("joint-centering", "damping"),
    ("weighted-least-norm", "rank_tolerance"),
    ("nullspace", "rank_tolerance"),
    ("nullspace", "damping"),
    ("nullspace-robust", "rank_tolerance"),
    ("nullspace-robust", "damping"),
    ("nullspace-unprojected", "rank_tolerance"),
    ("sns", "rank_tolerance"),
    ("sns-fast", "rank_tolerance"),
    ("sns-optimal", "rank_tolerance"),
    ("sns-margin", "rank_tolerance"),
]


@pytest.mark.parametrize("value", [-1.0, -1e-300, np.inf, np.nan])
@pytest.mark.parametrize(("name", "parameter"), NOT_NEGATIVE)
def test_wrong_parameter_is_one_line(name: str, parameter: str, value: float) -> None:
    """The message names the parameter and what would be valid, with its unit."""
    law: Any = make_formulation(name)
    message = f"{parameter}={value} must be finite and at least 0"
    with pytest.raises(DikbenchError, match=f"^{re.escape(message)}( |$)"):
        dataclasses.replace(law, **{parameter: value})


@pytest.mark.parametrize(("name", "parameter"), NOT_NEGATIVE)
def test_zero_is_valid(name: str, parameter: str) -> None:
    """Zero is the least value, and is not refused."""
    law: Any = make_formulation(name)
    assert getattr(dataclasses.replace(law, **{parameter: 0.0}), parameter) == 0
