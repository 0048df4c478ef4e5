"""What is wrong with a study file, in words of the file: the key, what it is, what is valid."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from dikbench.errors import DikbenchError, unknown

VALID: Final[Mapping[str, str]] = MappingProxyType(
    {
        "description": "a text in one line",
        "name": "a text",
        "cells": 'tables [[cells]], each with formulations = ["qp"] and, where wanted, '
        'solvers = ["daqp"]',
        "cells.formulations": 'a list of formulations, such as ["dls", "qp"]',
        "cells.solvers": 'a list of solvers, such as ["osqp", "daqp"]',
        "cells.scenarios": "a list of scenarios, in place of those of the study",
        "cells.plants": "a list of plants, in place of those of the study",
        "scenarios": 'a list of scenarios, such as ["reach", "near-miss[miss=0.02]"]',
        "plants": 'a list of plants, such as ["ideal"]',
        "references": 'a list of "time" and "path"',
        "instances": "a whole number that is at least 0, such as 100",
        "fraction": "a number above 0 and at most 1",
        "seeds": "a list of whole numbers that are at least 0, such as [0, 1]",
        "split": '"train" or "test"',
        "example": "one of the scenarios",
        "metrics": 'a list of metrics of yours, such as ["my_metric.py:REVERSALS"]',
        "timing": 'a section [timing] with reference = "dls"',
        "timing.reference": 'a formulation that needs no solver, such as "dls"',
        "timing.problems": "a whole number that is at least 1",
        "timing.rounds": "a whole number that is at least 1",
        "timing.scenarios": "a list of scenarios of the study",
    }
)
"""What stands behind each key; a key of a section has its section in front."""

_KINDS: Final = MappingProxyType(
    {
        "str": "a text",
        "int": "a whole number",
        "float": "a number",
        "bool": "true or false",
        "array": "a list",
        "object": "a section",
        "date": "a date",
        "time": "a time",
        "datetime": "a time",
    }
)
"""TOML's kinds of values by the names of msgspec."""


def explained(message: str) -> str:
    """Say in the words of a study file what msgspec found wrong with it."""
    said, _, place = message.partition(" - at `$.")
    place = place.rstrip("`")
    key = re.sub(r"\[\d+\]", "", place)
    if field := re.fullmatch(r"Object contains unknown field `(.+)`", said):
        return str(_unknown_key(field[1], key))
    if field := re.fullmatch(r"Object missing required field `(.+)`", said):
        name = f"{key}.{field[1]}" if key else field[1]
        return f"{f'{place}.' if place else ''}{field[1]} is missing; valid: {VALID[name]}"
    if value := re.fullmatch(r"Invalid enum value (.+)", said):
        return f"{place} = {value[1]} is not valid; valid: {VALID[key]}"
    got = re.search(r"got `(.+)`", said)
    if got:
        what = f"is {_KINDS.get(got[1], got[1])}"
    elif "array" in said:
        what = "is empty"
    else:
        what = "is too large" if "<" in said else "is too small"
    return f"{place} {what}; valid: {VALID[key]}"


def _unknown_key(name: str, section: str) -> DikbenchError:
    """Build the error for a key that a study, or a section of it, does not have."""
    inside = f"{section}." if section else ""
    keys = [key.removeprefix(inside) for key in VALID if key.startswith(inside)]
    place = f"of [{section}]" if section else "of a study"
    return unknown("key", name, [key for key in keys if "." not in key], place)
