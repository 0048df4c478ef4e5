"""Selectors: `name`, `name[parameter=value,...]` or `path/to/file.py:Class[...]`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from dikbench.errors import DikbenchError

_FORM = re.compile(r"(?P<name>[^\[\]\s][^\[\]]*?)(\[(?P<parameters>[^\[\]]*)\])?")


@dataclass(frozen=True)
class Selector:
    """A name and its parameters, as text.

    Attributes:
        text: the selector as it was given.
        name: what is selected.
        parameters: the parameters that were given, in their order.
    """

    text: str
    name: str
    parameters: Mapping[str, str]


def parse_selector(text: str) -> Selector:
    """Split a selector into its name and its parameters.

    Raises:
        DikbenchError: if the text has not the form `name[parameter=value,...]`.
    """
    match = _FORM.fullmatch(text.strip())
    if match is None:
        raise DikbenchError(
            f"selector {text!r} is not of the form name or name[parameter=value,...]"
        )
    parameters: dict[str, str] = {}
    inside = match["parameters"]
    for item in inside.split(",") if inside and inside.strip() else ():
        key, equals, value = (part.strip() for part in item.partition("="))
        if not equals or not key or not value:
            raise DikbenchError(f"selector {text!r}: {item.strip()!r} is not parameter=value")
        if key in parameters:
            raise DikbenchError(f"selector {text!r}: parameter {key!r} is given twice")
        parameters[key] = value
    return Selector(text.strip(), match["name"].strip(), MappingProxyType(parameters))
