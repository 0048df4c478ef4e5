"""What scenario families declare of themselves for figures."""

from __future__ import annotations

from dikbench.parameters import parameters_of
from dikbench.plugins.finding import plugins
from dikbench.scenario.family import Family


def declared_family(name: str) -> type[Family] | None:
    """Return the class of a family; None where it is not registered here.

    A family that is given as a file is not looked at: results are data, and remaking their report
    must not run what they name.
    """
    plugin = plugins("scenario").get(name)
    return None if plugin is None else plugin.factory


def with_unit(family: str, parameter: str) -> str:
    """Name a parameter of a family with its unit in brackets, where one is declared."""
    found = declared_family(family)
    declared = None if found is None else parameters_of(found).get(parameter)
    unit = "" if declared is None or declared.range is None else declared.range.unit
    return f"{parameter} [{unit}]" if unit else parameter
