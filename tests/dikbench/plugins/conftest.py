"""Plug-ins of other projects, made on the spot."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable, Iterator
from functools import partial
from types import ModuleType
from typing import Any

import pytest
from makers.plugins import Install

from dikbench.plugins.finding import plugins
from dikbench.user_code import registered


class _EntryPoint:
    """An entry point whose module is made on the spot."""

    def __init__(self, name: str, load: Callable[[], ModuleType]) -> None:
        self.name = name
        self.value = f"{name}_module"
        self.load = load


def _same(module: ModuleType) -> ModuleType:
    return module


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Replace every registered plug-in; each argument is a module, a table or a loader."""

    def replace_all(group: str, **entries: Any) -> None:
        points = []
        for name, entry in entries.items():
            if isinstance(entry, ModuleType):
                points.append(_EntryPoint(name, partial(_same, entry)))
            elif callable(entry):
                points.append(_EntryPoint(name, entry))
            else:
                module = ModuleType(name)
                module.__file__ = f"/somewhere/{name}.py"
                setattr(module, group.removeprefix("dikbench.").upper(), entry)
                points.append(_EntryPoint(name, partial(_same, module)))
        known = {group: points}
        monkeypatch.setattr(
            importlib.metadata, "entry_points", lambda *, group: known.get(group, [])
        )
        plugins.cache_clear()
        registered.cache_clear()

    yield replace_all
    monkeypatch.undo()
    plugins.cache_clear()
    registered.cache_clear()
