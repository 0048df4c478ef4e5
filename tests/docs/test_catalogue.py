"""The reference that is written from docstrings: all is in it, and nothing is cited in vain."""

from __future__ import annotations

import importlib.util
import inspect
import re
from typing import Any

import pytest
from makers.pages import CHECKOUT

from dikbench.cli import commands
from dikbench.metrics import METRICS
from dikbench.plugins.finding import formulations_and_peers, plugins


@pytest.fixture(scope="module")
def catalogue() -> Any:
    """The module that writes it, which is no part of the package."""
    spec = importlib.util.spec_from_file_location("catalogue", CHECKOUT / "docs" / "catalogue.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_formulation_has_a_section_with_its_program(catalogue: Any) -> None:
    """And each of its parameters a row."""
    text = catalogue.formulations()
    for name, plugin in plugins("formulation").items():
        section = text.partition(f"## {name}\n")[2].partition("\n## ")[0]
        assert section
        for parameter in plugin.parameters:
            assert f"| `{parameter}` |" in section
    assert "min_v  sum_i 1/2 ||J_i v - V_i||^2_(W_i)" in text


def test_a_symbol_means_itself(catalogue: Any) -> None:
    """Outside of code nothing is taken for markup."""
    assert catalogue.prose("|q_1| < a * b, `a_b`") == r"\|q\_1\| \< a \* b, `a_b`"


def test_every_cited_key_is_a_reference(catalogue: Any) -> None:
    """Keys are in brackets and begin with a capital letter."""
    cited = {
        key
        for plugin in formulations_and_peers().values()
        for key in re.findall(r"\[([A-Z]\w+)\]", inspect.getdoc(plugin.factory) or "")
    }
    cited |= {key for metric in METRICS.values() for key in re.findall(r"\[(\w+)\]", metric.source)}
    assert len(cited) > 20
    assert cited <= set(catalogue.keys())
    for key in cited:
        assert f"({catalogue.label(key)})=" in catalogue.references()


def test_every_command_and_metric_is_there(catalogue: Any) -> None:
    """With its options."""
    text = catalogue.command_line()
    for name in commands.commands:
        assert f"## dikbench {name}\n" in text
    assert "--trial-timeout" in text
    rows = catalogue.metrics()
    assert all(f"| `{name}` |" in rows for name in METRICS)
