"""Notebooks as scripts in jupytext's percent format, run and written in Markdown."""

from __future__ import annotations

import ast
import contextlib
import io
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jupytext

CHECKOUT = Path(__file__).parents[1]


def in_markdown(script: str) -> str:
    """Run a script cell by cell and write it in Markdown, with what each cell prints or ends in.

    It runs in an empty folder, in which `results` are the committed ones.
    """
    names: dict[str, Any] = {"__name__": "__main__"}
    shown = []
    with _in_folder():
        for cell in jupytext.reads(script, fmt="py:percent").cells:
            if cell.cell_type == "markdown":
                shown.append(cell.source)
                continue
            shown.append(f"```python\n{cell.source}\n```")
            if printed := _run(cell.source, names):
                shown.append(f"```text\n{printed}\n```")
    return "\n\n".join(shown)


@contextlib.contextmanager
def _in_folder() -> Iterator[None]:
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "results").symlink_to(CHECKOUT / "results")
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def _run(source: str, names: dict[str, Any]) -> str:
    """Run a cell, and return what it prints and its last expression, as a notebook shows it."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(io.StringIO()):
        exec(compile(tree, "<cell>", "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "<cell>", "eval"), names)
            if value is not None:
                print(value)
    return printed.getvalue().rstrip()
