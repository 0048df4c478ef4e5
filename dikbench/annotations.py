"""The types and markers that a class and its bases declare for a field."""

from __future__ import annotations

import inspect
import sys
import typing
from collections.abc import Iterator, Mapping
from types import MappingProxyType, NoneType, SimpleNamespace, UnionType
from typing import Any, Final, TypeVar, Union

Marker = TypeVar("Marker")

_WORDS: Final[Mapping[Any, str]] = MappingProxyType(
    {
        bool: "true or false",
        float: "a number",
        int: "a whole number",
        str: "a text",
        NoneType: "none",
    }
)


def declared_types(plugin: type, name: str) -> Iterator[Any]:
    """Yield the types that a class and its bases declare for a field, its own first.

    Each is resolved by itself in the module that declares it, so that a name imported for type
    checkers only gives None and does not affect the others.
    """
    for owner in plugin.__mro__:
        written = inspect.get_annotations(owner).get(name)
        if written is None and name not in inspect.get_annotations(owner):
            continue
        alone = SimpleNamespace(__annotations__={name: written})
        names = getattr(sys.modules.get(owner.__module__), "__dict__", {})
        try:
            yield typing.get_type_hints(alone, names, include_extras=True)[name]
        except (NameError, AttributeError, TypeError, SyntaxError):
            yield None


def type_in_words(kind: Any) -> str:
    """Name a type for readers who need not know Python."""
    parts = typing.get_args(kind) if typing.get_origin(kind) in (Union, UnionType) else (kind,)
    return " or ".join(_WORDS.get(part, getattr(part, "__name__", str(part))) for part in parts)


def marker_in(hints: list[Any], kind: type[Marker]) -> Marker | None:
    """Return the first marker of a kind: a field with a new default keeps its base's range."""
    for hint in hints:
        for marker in getattr(hint, "__metadata__", ()):
            if isinstance(marker, kind):
                return marker
    return None
