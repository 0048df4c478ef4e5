"""The source of a plug-in: its own file and the modules that it imports from its package."""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import sys
from functools import lru_cache
from pathlib import Path
from typing import Final

from dikbench.plugins.finding import Plugin

SHARED_PACKAGES: Final = ("formulations", "scenarios")
"""Packages whose modules belong to the source of a plug-in that imports them, like those of its own
package. The harness does not, since its version is recorded."""


def source_digest(plugin: Plugin) -> str:
    """Hash the source of a plug-in to 16 hexadecimal digits.

    The source is its own file and the modules of its package that it imports, directly or
    indirectly: plug-ins that share a module change with it, and no others do.
    """
    return digest_of_module(plugin.factory.__module__, plugin.file)


def digest_of_module(module: str, file: str) -> str:
    """Hash a module and those of its package that it imports (see `source_digest`)."""
    packages = frozenset({*SHARED_PACKAGES, module.partition(".")[0]})
    files: dict[str, str] = {module: file}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        for imported in _imported(files[name], name, packages) - files.keys():
            files[imported] = _file(imported)
            waiting.append(imported)
    return digest("\n".join(f"{name} {digest_of_file(files[name])}" for name in sorted(files)))


@lru_cache(maxsize=256)
def digest_of_file(file: str) -> str:
    """Hash a file's contents; empty where there is no file (a class made at a prompt)."""
    try:
        return digest(Path(file).read_bytes().decode(errors="replace"))
    except OSError:
        return ""


def digest(text: str) -> str:
    """Hash a text to 16 hexadecimal digits."""
    return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


@lru_cache(maxsize=1024)
def _imported(file: str, module: str, packages: frozenset[str]) -> frozenset[str]:
    """Find the modules of some packages that a file imports anywhere as module `module`."""
    try:
        tree = ast.parse(Path(file).read_bytes())
    except (OSError, SyntaxError, ValueError):  # no file, or not one of Python
        return frozenset()
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [(alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [(_base(node, file, module), alias.name) for alias in node.names]
        else:
            continue
        for base, name in names:
            if base.partition(".")[0] in packages:  # looking for others would import them
                inner = f"{base}.{name}"
                found.add(inner if name and _file(inner) else base)
    return frozenset(found)


def _base(node: ast.ImportFrom, file: str, module: str) -> str:
    """Return the absolute name of the module from which an import takes names."""
    if not node.level:
        return node.module or ""
    parts = module.split(".")
    up = node.level - (Path(file).name == "__init__.py")
    parents = parts[: len(parts) - up]
    return ".".join([*parents, node.module] if node.module else parents)


@lru_cache(maxsize=1024)
def _file(module: str) -> str:
    """Return the file of a module; empty where it has none or is no module."""
    loaded = sys.modules.get(module)
    if loaded is not None:
        return getattr(loaded, "__file__", None) or ""
    try:
        spec = importlib.util.find_spec(module)
    except (ImportError, AttributeError, ValueError):  # its parent is not a package
        return ""
    return (spec.origin or "") if spec is not None and spec.has_location else ""
