"""What differs between the manifests of two runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

COMPARED: Final = ("git_commit", "python", "libraries", "solvers")

MACHINE: Final = ("cpu", "cores", "system", "governor", "blas", "threads")
"""What times depend on beside the code."""


def version_differences(
    a: Mapping[str, Any], b: Mapping[str, Any], keys: tuple[str, ...] = (*COMPARED, *MACHINE)
) -> list[tuple[str, str, str]]:
    """What differs: name, value in A, value in B; "-" where one does not say."""
    flat_a, flat_b = _flat(a, keys), _flat(b, keys)
    return [
        (name, flat_a.get(name, "-"), flat_b.get(name, "-"))
        for name in dict.fromkeys([*flat_a, *flat_b])
        if flat_a.get(name) != flat_b.get(name)
    ]


def same_machine(a: Mapping[str, Any], b: Mapping[str, Any]) -> bool:
    """Whether two runs were made on machines that describe themselves alike."""
    return not version_differences(a, b, MACHINE)


def _flat(manifest: Mapping[str, Any], keys: tuple[str, ...]) -> dict[str, str]:
    found: dict[str, str] = {}
    for key in keys:
        value = manifest.get(key)
        if isinstance(value, Mapping):
            found |= {name: str(entry) for name, entry in value.items() if entry is not None}
        elif value is not None:
            found[key] = str(value)
    return found
