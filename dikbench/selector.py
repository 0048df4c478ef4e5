"""Selectors: `name`, `name[parameter=value,...]` or `path/to/file.py:Class[...]`.

Where a study or the command line selects, a value may be a list, `value|value`; several lists make
a product. A name or a value with one of the characters `,|[]` in it stands in quotes. `name[tuned]`
is a formulation at its tuned parameters.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from types import MappingProxyType
from typing import Final

from dikbench.errors import DikbenchError

TUNED: Final = "tuned"
"""The word in a formulation's brackets that stands for its tuned parameters."""

_QUOTED = re.compile(r"""'[^']*'|"[^"]*\"""")
_FORM = re.compile(r"(?P<name>[^\[\]\s][^\[\]]*?)(\[(?P<parameters>[^\[\]]*)\])?")
_NAME_NEEDS_QUOTES = re.compile(r"""[\[\]'"]|^\s|\s$""")
_VALUE_NEEDS_QUOTES = re.compile(r"""[,|\[\]'"]|^\s|\s$""")


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
        name = quoted(self.name, _NAME_NEEDS_QUOTES)
        return f"{name}[{listed(self.parameters)}]" if self.parameters else name

    def ordered(self, names: Iterable[str]) -> Selector:
        """Return the same selector, its parameters in the order of `names`, others last."""
        known = {name: self.parameters[name] for name in names if name in self.parameters}
        return Selector(self.name, {**known, **self.parameters})


def listed(parameters: Mapping[str, object]) -> str:
    """Write parameters as they stand in the brackets of a selector."""
    return ",".join(f"{name}={quoted(str(value))}" for name, value in parameters.items())


def quoted(text: str, where: re.Pattern[str] = _VALUE_NEEDS_QUOTES) -> str:
    """Put a text in quotes where a selector needs them."""
    if not where.search(text):
        return text
    return f"'{text}'" if '"' in text else f'"{text}"'


def parse_selector(text: str | Selector) -> Selector:
    """Split a selector into its name and its parameters; return a parsed one unchanged.

    Raises:
        DikbenchError: if the text has not the form `name[parameter=value,...]`.
    """
    return text if isinstance(text, Selector) else _parsed(text)


@lru_cache(maxsize=65536)
def _parsed(text: str) -> Selector:
    """Parse a text, of which a table of results has many alike."""
    name, parameters = _parts(text)
    return Selector(_unquoted(name), {key: _unquoted(value) for key, value in parameters.items()})


def _parts(text: str) -> tuple[str, dict[str, str]]:
    """Split a selector into its name and its parameters, which keep their quotes."""
    given, text = text, text.strip()
    match = _FORM.fullmatch(_without_quoted(text))
    if match is None:
        raise DikbenchError(
            f"selector {given!r} is not of the form name or name[parameter=value,...]"
        )
    parameters: dict[str, str] = {}
    inside = text[slice(*match.span("parameters"))] if match["parameters"] else ""
    for item in _split(inside, ",") if inside.strip() else ():
        key, equals, value = (part.strip() for part in item.partition("="))
        if (key, equals) == (TUNED, ""):
            equals, value = "=", "true"
        if not equals or not key or not _unquoted(value):
            raise DikbenchError(f"selector {given!r}: {item.strip()!r} is not parameter=value")
        if key in parameters:
            raise DikbenchError(f"selector {given!r}: parameter {key!r} is given twice")
        parameters[key] = value
    return text[slice(*match.span("name"))].strip(), parameters


def _without_quoted(text: str) -> str:
    """Replace what is in quotes by as many letters."""
    return _QUOTED.sub(lambda part: "q" * len(part[0]), text)


def _split(text: str, at: str) -> list[str]:
    """Split a text at a character outside of quotes."""
    ends = [place.start() for place in re.finditer(re.escape(at), _without_quoted(text))]
    return [
        text[a:b] for a, b in zip([0, *(end + 1 for end in ends)], [*ends, len(text)], strict=True)
    ]


def _unquoted(text: str) -> str:
    return text[1:-1] if _QUOTED.fullmatch(text) else text


def alternatives(text: str) -> list[Selector]:
    """Return the selectors with one value per parameter that a selector with lists stands for.

    `dls[damping=0.01|0.1]` stands for `dls[damping=0.01]` and `dls[damping=0.1]`; several lists
    make a product, in which the last one varies fastest.

    Raises:
        DikbenchError: if the text is no selector, or a value of a list is missing or given twice.
    """
    name, parameters = _parts(text)
    lists = [
        [_unquoted(value.strip()) for value in _split(values, "|")]
        for values in parameters.values()
    ]
    for key, values in zip(parameters, lists, strict=True):
        if not all(values) or len(set(values)) < len(values):
            raise DikbenchError(f"selector {text!r}: {key} lists an empty value, or one twice")
    return [
        Selector(_unquoted(name), dict(zip(parameters, chosen, strict=True)))
        for chosen in itertools.product(*lists)
    ]
