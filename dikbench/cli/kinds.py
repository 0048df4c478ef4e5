"""What a name on the command line stands for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

from dikbench.metrics import EVERY_METRIC
from dikbench.plugins.finding import formulations_and_peers, kind_of, plugins
from dikbench.robots.plugged import EVERY_ROBOT
from dikbench.solvers.catalogue.back_ends import SOLVERS
from dikbench.user_code import Kind, Pluggable, in_file, named_in_file

PLUGGABLE: Final[Mapping[Kind, Pluggable]] = MappingProxyType(
    {"solver": SOLVERS, "robot": EVERY_ROBOT, "metric": EVERY_METRIC}
)

IN_WORDS: Final[Mapping[Kind, str]] = MappingProxyType(
    {
        "formulation": "a formulation",
        "scenario": "a scenario family",
        "solver": "a solver",
        "plant": "a plant",
        "robot": "a robot",
        "metric": "a metric",
    }
)


def kind_of_value(value: Any) -> Kind | None:
    """Say what kind of plug-in something is; None where it is none."""
    for kind, pluggable in PLUGGABLE.items():
        if not pluggable.misfit(value):
            return kind
    return kind_of(value)


def kind_named(name: str) -> Kind | None:
    """Say what kind of plug-in a name stands for; None where it is the name of none.

    Raises:
        DikbenchError: if it names a file that cannot be imported, or does not hold it.
    """
    if in_file(name):
        value = named_in_file(name, lambda each: kind_of_value(each) is not None, NOTHING).value
        return kind_of_value(value) or _meant(value)
    known: dict[Kind, Callable[[], Any]] = {
        "formulation": formulations_and_peers,
        "scenario": lambda: plugins("scenario"),
        "plant": lambda: plugins("plant"),
        **{kind: pluggable.names for kind, pluggable in PLUGGABLE.items()},
    }
    return next((kind for kind, names in known.items() if name in names()), None)


NOTHING: Final = "no formulation and no family, solver, plant, robot or metric"


def _meant(value: Any) -> Kind:
    """Say what a class that is no plug-in is meant to be, so that the error says what it lacks."""
    bases = {each.__name__ for each in getattr(value, "__mro__", ())}
    return "solver" if "SolverLibrary" in bases else "formulation"
