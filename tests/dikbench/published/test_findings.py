"""What stands in `results/findings.md`: commands that exist, and the numbers that they print."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dikbench.published.experiment import load_experiment, published_experiments
from dikbench.published.reproducing import as_markdown, reproduce

CHECKOUT = Path(__file__).parents[3]
RESULTS = CHECKOUT / "results"
pytestmark = pytest.mark.skipif(not RESULTS.is_dir(), reason="the results are no part of the sdist")

SHOULD_KNOW = "What the field should know"
COMMAND = re.compile(r"^dikbench reproduce ([\w-]+)$", re.MULTILINE)


def parts(text: str, level: int) -> dict[str, str]:
    """The parts of a page under headings of a level, by heading."""
    pieces = re.split(rf"^{'#' * level} (.+)$", text, flags=re.MULTILINE)
    return dict(zip(pieces[1::2], pieces[2::2], strict=True))


def findings() -> dict[str, str]:
    """The six findings, by heading; none where the page is not there."""
    page = RESULTS / "findings.md"
    if not page.is_file():
        return {}
    return parts(parts(page.read_text(encoding="utf-8"), 2)[SHOULD_KNOW], 3)


def rows(text: str) -> list[str]:
    """The rows of the tables of a text, headings apart."""
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    return [line for line in lines if not line.startswith("| row |")]


def test_there_are_six_findings_each_with_one_command_and_its_table() -> None:
    """A command that is one of `dikbench list published`; the table has all of its rows."""
    found = findings()
    assert len(found) == 6
    for heading, text in found.items():
        (name,) = COMMAND.findall(text)
        assert name in published_experiments(), heading
        assert len(rows(text)) == len(load_experiment(name).rows), heading


def test_the_tables_of_the_findings_are_those_of_the_published_page() -> None:
    """Line by line: both come from one run."""
    page = parts((RESULTS / "published.md").read_text(encoding="utf-8"), 2)
    written = {heading.partition(":")[0]: rows(text) for heading, text in page.items()}
    assert set(written) == set(published_experiments())
    for text in findings().values():
        (name,) = COMMAND.findall(text)
        assert rows(text) == written[name]


def test_the_versions_are_the_tested_ones() -> None:
    """As pinned for `pip install -c constraints.txt`."""
    page = (RESULTS / "findings.md").read_text(encoding="utf-8")
    (line,) = re.findall(r"^Versions: (.+)\.$", page, re.MULTILINE)
    pinned = dict(
        each.split("==")
        for each in (CHECKOUT / "constraints.txt").read_text().split()
        if "==" in each
    )
    for package, version in (each.split() for each in line.split(", ")):
        assert pinned[package] == version


@pytest.mark.long
@pytest.mark.parametrize("heading", findings())
def test_a_command_prints_what_is_written(heading: str) -> None:
    """But for the rows of packages that are not installed."""
    (name,) = COMMAND.findall(findings()[heading])
    ((_, found),) = reproduce([name], 1)
    printed = rows(as_markdown(name, found))
    for here, row, written in zip(found, printed, rows(findings()[heading]), strict=True):
        assert row == written or "not installed" in here.verdict
