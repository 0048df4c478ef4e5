"""Cases of which the normal run has some, in turns."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import Any

import pytest


def in_turns(*axes: Iterable[Any], every: int = 2) -> list[Any]:
    """Cross axes; all but one case in so many are `long`, and every value has its turns."""
    return [
        pytest.param(
            *(value for _, value in case),
            marks=() if sum(place for place, _ in case) % every == 0 else pytest.mark.long,
        )
        for case in product(*(list(enumerate(axis)) for axis in axes))
    ]
