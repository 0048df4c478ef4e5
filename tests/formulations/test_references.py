"""The references page: every key that a law or a metric names, and no other."""

from __future__ import annotations

import re
from pathlib import Path

import formulations
from dikbench.cli.listing import listing
from dikbench.metrics import METRICS
from dikbench.plugins.finding import formulations_and_peers

FOLDER = Path(formulations.__file__).parent
KEY = re.compile(r"\[([A-Z]\w+)\]")
SOURCES = {name: plugin.source for name, plugin in formulations_and_peers().items()}
ENTRIES = re.findall(r"^- \*\*\[(\w+)\]\*\*", (FOLDER / "REFERENCES.md").read_text(), re.MULTILINE)


def test_every_law_names_sources_that_the_page_resolves() -> None:
    """Each law has a source with at least one key, and every key has an entry."""
    for name, source in SOURCES.items():
        keys = KEY.findall(source)
        assert keys, name
        assert set(keys) <= set(ENTRIES), name


def test_every_metric_names_a_paper_that_the_page_resolves_or_is_our_own() -> None:
    """A single key, or dikbench."""
    for name, metric in METRICS.items():
        keys = KEY.findall(metric.source)
        assert len(keys) == 1 or metric.source == "dikbench", name
        assert set(keys) <= set(ENTRIES), name


def test_every_entry_of_the_page_is_used() -> None:
    """No reference stands there that no law's and no metric's source names."""
    sources = [*SOURCES.values(), *(metric.source for metric in METRICS.values())]
    used = {key for source in sources for key in KEY.findall(source)}
    assert set(ENTRIES) - used == set()


def test_entries_are_in_alphabetical_order_and_single() -> None:
    """So that a reader finds them, and nobody adds one twice."""
    assert sorted(set(ENTRIES), key=str.lower) == ENTRIES


def test_the_list_of_laws_shows_the_keys_once_bracketed() -> None:
    """A line is name, summary and keys, as in `pinv  Resolved-rate control: ... [Whitney1969]`."""
    lines = listing("formulations")
    assert any(line.startswith("pinv ") and line.endswith(" [Whitney1969]") for line in lines)
    assert not any("[[" in line or "]]" in line for line in lines)
