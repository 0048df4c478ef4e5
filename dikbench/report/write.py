"""The report of a results folder: tables, figures, report.html and report.md."""

from __future__ import annotations

from pathlib import Path

from dikbench.errors import DikbenchError
from dikbench.report.contents.contents import Contents, gather
from dikbench.report.figures.every import draw_figures
from dikbench.report.interactive.embedded import embed
from dikbench.report.pages.html_page import render_html
from dikbench.report.pages.markdown_page import render_markdown
from dikbench.report.tables.build import make_table
from dikbench.report.tables.console import to_text
from dikbench.report.tables.files import write_table
from dikbench.report.tables.instances import write_instances
from dikbench.report.tables.kinds import TIMING
from dikbench.report.tables.leads import write_leads
from dikbench.report.tables.markdown import markdown_rows
from dikbench.report.tables.peers import write_peers_tables
from dikbench.report.tables.return_codes import TITLE as RETURN_CODES
from dikbench.results.folder import ResultsFolder
from dikbench.results.instances import read_attempts
from dikbench.results.peers import read_peers
from dikbench.results.reading import read_results, without_attributes
from dikbench.results.selected import with_selected
from dikbench.statistics.stability import STABLE


def write_report(path: Path) -> str:
    """Make tables, figures, report.html and report.md from what a run left in its folder.

    Returns:
        What is to be printed: the tables over all families and what to keep in mind.

    Raises:
        DikbenchError: if the folder holds no results, or cannot be written.
    """
    results = without_attributes(read_results(path, lenient=True))
    try:
        contents = gather(results, draw_figures(results.folder, results.trials, results.manifest))
        codes = _write_tables(path, contents)
        write_instances(read_attempts(path), path / "tables")
        write_leads(results.trials, path / "tables")
        write_peers_tables(read_peers(path), path / "tables")
        page = render_html(contents, path / "figures", embed(results.trials))
        (path / "report.html").write_text(page, encoding="utf-8")
        (path / "report.md").write_text(render_markdown(contents), encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise DikbenchError(f"report in {path} cannot be written: {reason}") from None
    counts = ", ".join(f"{number} {what}" for number, what in contents.counts)
    printed = [*map(to_text, contents.tables), f"{RETURN_CODES}\n\n{codes}\n", f"{counts}.\n"]
    if len(contents.peers):
        printed.append(f"{contents.peers_note}\n\n{markdown_rows(contents.peers)}\n")
    for limitation in contents.limitations:
        printed += [f"- {limitation.text}", *(f"  - {case}" for case in limitation.cases)]
    return "\n".join(printed)


def write_times(path: Path) -> str:
    """Make the timing table of a results folder.

    Returns:
        What is to be printed: the table over all scenarios, and which cells are not stable.

    Raises:
        DikbenchError: if the folder holds no results.
    """
    with ResultsFolder(path).open_store() as store:
        times = store.times()
    table = make_table(TIMING, with_selected(times).assign(status="ok"))
    write_table(table, path / "tables")
    unstable = times[times["timing_stability"] != STABLE]
    told = [
        f"- {row.formulation} with {row.solver} on {row.scenario}: {row.timing_stability}."
        for row in unstable.itertuples()
    ]
    return "\n".join([to_text(table), *told])


def _write_tables(path: Path, contents: Contents) -> str:
    """Write the tables as files, and give that of the return codes as text."""
    for table in contents.tables:
        write_table(table, path / "tables")
    codes = contents.return_codes
    text = markdown_rows(codes) if len(codes) else "Nothing was solved."
    codes.to_csv(path / "tables" / "return_codes.csv", index=False)
    page = f"# {RETURN_CODES}\n\n{text}\n"
    (path / "tables" / "return_codes.md").write_text(page, encoding="utf-8")
    return text
