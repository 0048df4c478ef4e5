from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from html.parser import HTMLParser
from importlib import resources
from itertools import pairwise
from pathlib import Path

import pandas as pd
import pytest
from makers.rows import Values, make_rows, write_results
from makers.runs import not_played

from dikbench.report.tables.table import Column, TableCell
from dikbench.report.write import write_report

VOID = {"meta", "img", "input", "br", "link", "hr"}
HOSTILE = '<script>alert("1")</script>&amp;`<img src=x onerror=alert(1)>`../../x'


@dataclass
class Page(HTMLParser):
    """A page as its tags: open ones are counted, text is kept by the tag that it stands in."""

    tags: list[tuple[str, dict[str, str | None]]] = field(default_factory=list)
    text: list[tuple[str, str]] = field(default_factory=list)
    open: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Set the parser up."""
        super().__init__(convert_charrefs=True)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keep it, and that it is open."""
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Close the last one that is open, which it must be."""
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        """Keep it with the tag that it stands in."""
        self.text.append((self.open[-1] if self.open else "", data))

    @classmethod
    def of(cls, file: Path) -> Page:
        """Read a page; every tag that is opened must be closed, in order."""
        page = cls()
        page.feed(file.read_text(encoding="utf-8"))
        page.close()
        assert page.open == []
        return page

    def shown(self) -> str:
        """What a reader sees."""
        return " ".join(
            " ".join(data for tag, data in self.text if tag not in {"script", "style"}).split()
        )


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a report on two plants, with a failure, unstable times and a hostile law."""
    folder = tmp_path_factory.mktemp("report") / "out"
    scenarios = (
        "reach", "near-miss[miss=0.02]", f"near-miss[robot={HOSTILE.replace('`', '')}]",
        "near-miss[miss=0.05]", "near-miss[miss=0.2]",
    )  # fmt: skip
    times = {
        "formulation_time_median_us": 10.0,
        "formulation_time_p99_us": 12.0,
        "timing_stability": "stable",
    }
    formulations: dict[str | tuple[str, str], Values] = {
        "pinv": {"outcome": ["success", "late", "left-path", "late", "late"], **times},
        "dls[damping=0.1]": {"position_error_rms_m": 0.02, **times, "timing_stability": "drift"},
        ("qp", "daqp"): {
            "position_error_rms_m": 1e-5,
            "claimed_share": 1.0,
            "verified_share": 0.9,
            "disagreed_share": 0.1,
        },
        HOSTILE: {
            "status": ["ok", "formulation-error", "ok", "ok", "ok"],
            "outcome": ["success", "did-not-run", "success", "success", "success"],
            "message": f"RuntimeError: {HOSTILE}",
        },
    }
    rows = [
        make_rows(formulations, scenarios, seeds=(0, 1), plant=p) for p in ("ideal", "saturating")
    ]
    write_results(
        folder,
        pd.concat(rows, ignore_index=True),
        command=f"dikbench run {HOSTILE}",
        study={"name": HOSTILE, "description": HOSTILE},
    )
    write_report(folder)
    return folder


def test_the_page_is_well_formed_and_its_ids_are_unique(report: Path) -> None:
    """Every tag is closed in order, no id occurs twice, and what refers to an id finds it."""
    page = Page.of(report / "report.html")
    ids = [given["id"] for _, given in page.tags if "id" in given]
    assert len(ids) == len(set(ids))
    for _, given in page.tags:
        for name in ("aria-labelledby", "for"):
            assert given.get(name, ids[0]) in ids
        if (given.get("href") or "").startswith("#"):
            assert (given["href"] or "")[1:] in ids


def test_names_are_text_wherever_they_come_from(report: Path) -> None:
    """A law, scenario, message, study or command that holds HTML is shown as it is written."""
    page = Page.of(report / "report.html")
    scripts = [given for tag, given in page.tags if tag == "script"]
    assert len(scripts) == 3
    nonces = {given.get("nonce") for given in scripts if given.get("type") != "application/json"}
    [nonce] = nonces
    assert nonce
    assert not any(name.startswith("on") for _, given in page.tags for name in given)
    assert all(
        (given.get("src") or "").startswith("data:") for tag, given in page.tags if tag == "img"
    )
    shown = page.shown()
    assert '<script>alert("1")</script>&amp;' in shown
    assert "RuntimeError: <script>" in shown
    assert not any("../" in (given.get("id") or "") for _, given in page.tags)
    written = {path.relative_to(report).parts[0] for path in report.rglob("*")}
    assert written <= {
        "trials.csv", "manifest.json", "report.html", "report.md", "tables", "figures",
    }  # fmt: skip


def test_nothing_is_loaded_from_elsewhere(report: Path) -> None:
    """No address but those within the page and data stands in an attribute that loads."""
    page = Page.of(report / "report.html")
    for tag, given in page.tags:
        for name in ("src", "href", "action", "data", "poster", "srcset"):
            assert (given.get(name) or "#").startswith(("#", "data:")), (tag, given)
        assert tag not in {"link", "iframe", "object", "embed", "base"}
    text = (report / "report.html").read_text(encoding="utf-8")
    style = text.partition("<style>")[2].partition("</style>")[0]
    assert "url(" not in style
    assert "@import" not in style
    assert "default-src 'none'" in text


def test_headings_stand_in_order(report: Path) -> None:
    """One first-level heading, and none that skips a level."""
    page = Page.of(report / "report.html")
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch(r"h[1-6]", tag)]
    assert levels.count(1) == 1
    assert levels[0] == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))


def test_every_figure_is_within_and_described(report: Path) -> None:
    """Each figure has a text that stands for it, and a caption."""
    page = Page.of(report / "report.html")
    images = [given for tag, given in page.tags if tag == "img"]
    assert len(images) == len(list((report / "figures").glob("*.svg"))) > 0
    assert all(given["alt"] for given in images)
    assert len([tag for tag, _ in page.tags if tag == "figcaption"]) == len(images)


def test_the_best_is_marked_and_unstable_times_are_greyed(report: Path) -> None:
    """Stars stand at who may be first, alone in the table of success; a tilde at drifting times."""
    text = (report / "report.html").read_text(encoding="utf-8")
    rows = re.findall(
        r'<tr data-names="[^"]*"><th scope="row" class="name">(.*?)</th>(.*?)</tr>', text
    )
    starred = {name for name, cells in rows if "class=best" in cells.replace('"', "")}
    assert starred == {"qp", "dls[damping=0.1]"}
    unstable = {name for name, cells in rows if "unstable" in cells}
    assert unstable == {"dls[damping=0.1]"}


def test_success_stands_first(report: Path) -> None:
    """Outcomes next; then the tables of all runs, and the solvers."""
    titles = (
        "Success: ",
        "Outcomes: ",
        "Tracking error: ",
        "Limit violation: ",
        "Timing",
        "Solvers",
    )
    text = (report / "report.html").read_text(encoding="utf-8")
    places = [text.index("<h3>" + title) for title in titles]
    assert places == sorted(places)


def test_columns_beyond_eight_are_behind_more(report: Path) -> None:
    """A table has a box for them if it has them, and a row of names for the filter."""
    text = (report / "report.html").read_text(encoding="utf-8")
    tables = re.findall(r'(<label class="more">.*?</label>\s*)?(<table class="sortable.*?</table>)',
                        text, re.DOTALL)  # fmt: skip
    counts = [
        (bool(box), table.count('<th scope="col"')) for box, table in tables if "title=" in table
    ]
    assert {has for has, _ in counts} == {True, False}
    for has_box, count in counts:
        assert has_box == (count > 8)


def test_own_script_is_glue() -> None:
    """At most 200 lines of code: what is more belongs to a library, or to Python."""
    report, viewer = resources.files("dikbench.report.pages"), resources.files("dikbench.viewer")
    files = report / "assets" / "page.js", viewer / "assets" / "replay.js"
    lines = [line.strip() for file in files for line in file.read_text("utf-8").splitlines()]
    code = [line for line in lines if line and not line.startswith("//")]
    assert len(code) <= 200
    assert max(map(len, code)) <= 120


def test_the_short_page_has_a_matrix_and_the_tables_that_fit(report: Path) -> None:
    """The best first, who did not run every trial last; of larger tables only where they are."""
    text = (report / "report.md").read_text(encoding="utf-8")
    matrix = text.partition("## Success by situation")[2].partition("\n## ")[0]
    rows = [line.split("|")[1:-1] for line in matrix.splitlines() if line.startswith("|")][2:]
    trials = [int(row[-1]) for row in rows]
    rates = [float(row[-2]) for row in rows if int(row[-1]) == max(trials)]
    assert len(rates) > 1
    assert rates == sorted(rates, reverse=True)
    assert trials[: len(rates)] == [max(trials)] * len(rates)
    assert "## Outcomes" not in text
    assert "(tables/outcomes.md)" in text
    assert len(text.splitlines()) < 200


def test_families_and_laws_are_described(report: Path) -> None:
    """What a family provokes, its certificate, a formulation's program, source and attributes."""
    shown = Page.of(report / "report.html").shown()
    assert "joint speeds beyond the limits near a singularity" in shown
    assert "smallest singular value on the path (m, rad) = 0.01347" in shown
    assert "It cannot be built here:" in shown
    assert "min ||J v - V||^2 + lambda^2 ||v||^2" in shown
    assert "[Wampler1986] C. W. Wampler." in shown
    assert "damping = 0.1" in shown
    assert "its source cannot be found here" in shown


def test_columns_say_what_they_are(report: Path) -> None:
    """Every heading of a column of numbers carries the definition of its number."""
    page = Page.of(report / "report.html")
    headings = [given for tag, given in page.tags if tag == "th" and given.get("scope") == "col"]
    assert sum("title" in given for given in headings) > len(headings) / 2


def test_the_markdown_says_the_same(report: Path) -> None:
    """report.md has the sentences, limitations and figures, and no tag of a hostile name."""
    text = (report / "report.md").read_text(encoding="utf-8")
    outside = re.sub(r"`[^`\n]*`", "", text)
    assert "<script>" not in outside
    assert "<img" not in outside
    for heading in ("Which formulation for which situation", "Limitations", "How it was made"):
        assert f"## {heading}" in text
    assert "First where" in text or "Nobody stands out where" in text
    for figure in (report / "figures").glob("*.svg"):
        assert f"(figures/{figure.name})" in text
    lines = text.split("\n")
    for before, line, after in zip(lines, lines[1:], lines[2:], strict=False):
        if line.startswith("#"):
            assert before == after == "", line
        if line == "":
            assert before != "", "two blank lines"


def test_a_figure_without_room_is_a_file_beside_the_page(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The page stays small, and says where the figure is."""
    monkeypatch.setattr("dikbench.report.pages.html_page.MOST", 100)
    folder = write_results(tmp_path / "out", make_rows({"pinv": {}}))
    with not_played():
        write_report(folder)
    page = Page.of(folder / "report.html")
    assert not [tag for tag, _ in page.tags if tag == "img"]
    assert "too large to be carried here" in page.shown()


def test_cells_are_sorted_by_their_number() -> None:
    """What a cell sorts by is its number, whatever stands beside it."""
    from dikbench.report.pages.html_page import _td

    column = Column("a", "a", "a")
    assert _td(TableCell(float("nan")), column) == "<td></td>"
    assert _td(TableCell(0.12345), column) == "<td>0.123</td>"
    assert _td(TableCell(1.0012), column) == "<td>1</td>"
    assert _td(TableCell(1.0012), replace(column, most=1.001)) == "<td>1.0012</td>"
    assert 'data-sort="2"' in _td(TableCell(2.0, 1.0, 3.0), column)
    assert 'data-sort="Infinity"' in _td(TableCell(float("inf")), column)
