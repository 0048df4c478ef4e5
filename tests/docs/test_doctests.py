"""The examples with prompts on the site's pages and in docstrings give what stands there."""

from __future__ import annotations

import doctest
import subprocess
import sys
from pathlib import Path

import pytest
from makers.pages import CHECKOUT, PAGES

WITH_PROMPTS = [page for page in PAGES if ">>> " in page.read_text(encoding="utf-8")]
IN_DOCSTRINGS = [
    file
    for package in ("dikbench", "formulations", "scenarios")
    for file in sorted((CHECKOUT / package).rglob("*.py"))
    if ">>> " in file.read_text(encoding="utf-8")
]


def test_there_are_examples() -> None:
    """Else this module tests nothing."""
    assert WITH_PROMPTS


@pytest.mark.parametrize("page", WITH_PROMPTS, ids=lambda page: page.name)
def test_examples_of_a_page(page: Path) -> None:
    """Each prompt, in order."""
    failed, tried = doctest.testfile(str(page), module_relative=False)
    assert tried > 0
    assert failed == 0


def test_examples_of_docstrings() -> None:
    """Each file in a process of its own, as `python -m doctest` does."""
    for file in IN_DOCSTRINGS:
        subprocess.run([sys.executable, "-m", "doctest", str(file)], check=True)
