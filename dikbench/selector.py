"""Selectors: `name`, `name[parameter=value,...]` or `path/to/file.py:Class[...]`.

Where a study or the command line selects, a value may be a list, `value|value`; several lists make
a product.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from dikbench.errors import DikbenchError

_FORM = re.compile(r"(?P<name>[^\[\]\s][^\[\]]*?)(\[(?P<parameters>[^\[\]]*)\])?")


@dataclass(frozen=True)
class Selector:
    """A name and its parameters as texts, parsed once where they enter.

    Selectors with the same name and parameters are equal, whatever the order of the parameters.

    Attributes:
        name: what is selected.
        parameters: the values that were given, by parameter, in their order.
    """

    name: str
    parameters: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Keep the parameters from being changed."""
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    def __hash__(self) -> int:
        """Hash name and parameters, whatever their order."""
        return hash((self.name, frozenset(self.parameters.items())))

    def __reduce__(self) -> tuple[type[Selector], tuple[str, dict[str, str]]]:
        """Pickle the parts."""
        return Selector, (self.name, dict(self.parameters))

    def __str__(self) -> str:
        """Write the selector as text, which `parse_selector` reads: `name[parameter=value,...]`."""
        return f"{self.name}[{listed(self.parameters)}]" if self.parameters else self.name

    def ordered(self, names: Iterable[str]) -> Selector:
        """Return the same selector, its parameters in the order of `names`, others last."""
        known = {name: self.parameters[name] for name in names if name in self.parameters}
        return Selector(self.name, {**known, **self.parameters})


def listed(parameters: Mapping[str, object]) -> str:
    """Write parameters as they stand in the brackets of a selector."""
    return ",".join(f"{name}={value}" for name, value in parameters.items())


def parse_selector(text: str | Selector) -> Selector:
    """Split a selector into its name and its parameters; return a parsed one unchanged.

    Raises:
        DikbenchError: if the text has not the form `name[parameter=value,...]`.
    """
    if isinstance(text, Selector):
        return text
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
    return Selector(match["name"].strip(), parameters)


def alternatives(text: str) -> list[Selector]:
    """Return the selectors with one value per parameter that a selector with lists stands for.

    `dls[damping=0.01|0.1]` stands for `dls[damping=0.01]` and `dls[damping=0.1]`; several lists
    make a product, in which the last one varies fastest.

    Raises:
        DikbenchError: if the text is no selector, or a value of a list is missing or given twice.
    """
    selector = parse_selector(text)
    lists = [[v.strip() for v in values.split("|")] for values in selector.parameters.values()]
    for key, values in zip(selector.parameters, lists, strict=True):
        if not all(values) or len(set(values)) < len(values):
            raise DikbenchError(f"selector {text!r}: {key} lists an empty value, or one twice")
    return [
        Selector(selector.name, dict(zip(selector.parameters, chosen, strict=True)))
        for chosen in itertools.product(*lists)
    ]
