"""A formulation's name selects every test of it, as registered or with underscores."""

from __future__ import annotations

import inspect
import re
from functools import cache

import pytest

from dikbench.plugins.finding import plugins


@cache
def named_in(function: object) -> frozenset[str]:
    """The formulations that the source of a test names in quotes, without their parameters."""
    quoted = re.findall(r"""["']([a-z-]+)[\["']""", inspect.getsource(function))  # type: ignore[arg-type]
    return frozenset(quoted) & plugins("formulation").keys()


def pytest_itemcollected(item: pytest.Item) -> None:
    """Let `-k lp_alpha` and `-k lp-alpha` select the tests of either spelling, and those inside."""
    assert isinstance(item, pytest.Function)
    for text in (item.name, *named_in(inspect.unwrap(item.function))):
        item.extra_keyword_matches.update({text.replace("-", "_"), text.replace("_", "-")})
