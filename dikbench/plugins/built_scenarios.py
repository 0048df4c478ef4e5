"""The scenarios of a report, each built once."""

from __future__ import annotations

from functools import lru_cache

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.scenario.scenario import Scenario


@lru_cache(maxsize=1024)
def built(selector: str, seed: int) -> Scenario | str:
    """A scenario, or why it cannot be built here: results may come from another installation."""
    try:
        return make_scenario(selector, seed)
    except DikbenchError as error:
        return str(error)
