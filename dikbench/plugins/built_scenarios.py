"""The scenarios of a report, each built once."""

from __future__ import annotations

from functools import lru_cache

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector, parse_selector
from dikbench.user_code import names_code


@lru_cache(maxsize=1024)
def built(selector: str | Selector, seed: int) -> Scenario | str:
    """Build a scenario of some results, or say why it cannot be built here.

    Results may be from another installation. A family or a robot in a file is not executed, since
    remaking a report must not run code that its data names.
    """
    if names_code(parse_selector(selector)):
        return f"scenario {selector} is code in a file, which a report does not run"
    try:
        return make_scenario(selector, seed)
    except DikbenchError as error:
        return str(error)
