"""What the keys in a formulation's `Source:` paragraph stand for."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Final

PAGE: Final = "REFERENCES.md"
"""The page of references, which stands beside the formulations that cite it."""

_ENTRY: Final = re.compile(r"^- \*\*\[(?P<key>[^\]]+)\]\*\* (?P<text>.+)$", re.MULTILINE)


def references(file: Path | None, source: str) -> tuple[str, ...]:
    """The works that a source cites by key, in its order; those without an entry are left out.

    Args:
        file: where the formulation is written.
        source: its `Source:` paragraph, with keys in brackets.
    """
    if file is None:
        return ()
    known = _page(file.parent / PAGE)
    cited = dict.fromkeys(re.findall(r"\[([^\]]+)\]", source))
    return tuple(f"[{key}] {known[key]}" for key in cited if key in known)


@lru_cache
def _page(file: Path) -> dict[str, str]:
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return {}
    return {entry["key"]: entry["text"] for entry in _ENTRY.finditer(text)}
