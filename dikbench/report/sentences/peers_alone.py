"""Peers in a run without the formulation that they are compared with."""

from __future__ import annotations

from collections.abc import Sequence

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation


def without_counterpart(formulations: Sequence[str]) -> dict[str, str]:
    """Return the counterpart that is missing of each peer among the formulations of a run.

    Args:
        formulations: their selectors; those that cannot be made here are passed over.
    """
    made = {}
    for name in formulations:
        try:
            made[name] = make_formulation(name)
        except DikbenchError:  # a file that is not there any more
            continue
    wanted = {name: getattr(each, "counterpart", "") for name, each in made.items()}
    return {
        name: counterpart
        for name, counterpart in wanted.items()
        if counterpart and make_formulation(counterpart) not in made.values()
    }
