"""Selectors: `name`, `name[parameter=value,...]` or `path/to/file.py:Class[...]`.

Where a study or the command line selects, a value may be a list, `value|value`; several lists make
a product.
"""

from __future__ import annotations

import itertools
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


def alternatives(text: str) -> list[str]:
    """The selectors, one value per parameter, that a selector with lists of values stands for.

    `dls[damping=0.01|0.1]` stands for `dls[damping=0.01]` and `dls[damping=0.1]`; several lists
    make a product, the last one running fastest.

    Raises:
        DikbenchError: if the text is no selector, or a value of a list is missing or given twice.
    """
    if "|" not in text:
        return [text]
    selector = parse_selector(text)
    lists = [[v.strip() for v in values.split("|")] for values in selector.parameters.values()]
    for key, values in zip(selector.parameters, lists, strict=True):
        if not all(values) or len(set(values)) < len(values):
            raise DikbenchError(f"selector {text!r}: {key} lists an empty value, or one twice")
    return [
        f"{selector.name}[{','.join(map('='.join, zip(selector.parameters, chosen, strict=True)))}]"
        for chosen in itertools.product(*lists)
    ]
