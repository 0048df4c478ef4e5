"""Published experiments run again: rows in worker processes, tables as Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from typing import Any, Final

import msgspec

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation
from dikbench.problem.problem import program_of
from dikbench.published.experiment import Experiment, Row, load_experiment, published_experiments
from dikbench.published.measured import (
    EQUAL,
    INSIDE_NOISE,
    NOT_REPRODUCED,
    Measured,
    Statistic,
    verdict,
)
from dikbench.published.searches import Searches
from dikbench.run.pool import workers
from dikbench.run.progress_display import ProgressDisplay

UNKNOWN_ITERATIONS: Final = 100.0
"""Mean iterations of a search, where none were published."""

OF_A_SOLVER: Final = 30.0
"""Time of a step of one search by a solver, over that of one of many at once without."""

HOLDS: Final = "holds"
DOES_NOT_HOLD: Final = "does not hold"
NOT_MEASURED: Final = "not measured"

EXPLANATION = """\
Each cell is *published / here*; "± x" is half of the noise band, two standard errors of the sample
(of a median, the order statistics two deviations from the middle). **equal**: every number is the
same, as printed. **inside noise**: every number is inside its band (the largest of a sample has
none and decides nothing). **not reproduced** names the columns that are not. **fitted**: settings
were searched for until the numbers came out, which explains them and proves nothing. **holds**,
**does not hold**: what was published is a statement, and the numbers are those that it implies.
**ours**: a row that was not published. **not covered**: nothing here does what the row is about;
**not measured**: a library is not installed. A row that is *as for* another formulation does not
distinguish the two; *not so for* it, it does."""


@dataclass(frozen=True)
class Reproduced:
    """A row of an experiment and what came of it.

    Attributes:
        row: the row.
        measured: by the names of the statistics; None where it is not covered.
        verdict: as the explanation says.
    """

    row: Row
    measured: dict[str, Measured] | None
    verdict: str


def reproduce(names: Sequence[str], jobs: int) -> Iterator[tuple[str, list[Reproduced]]]:
    """Run published experiments again, rows side by side.

    Args:
        names: of experiments; none: all of them.
        jobs: number of worker processes.

    Yields:
        Each experiment's name and rows, when all of these are measured.

    Raises:
        DikbenchError: if there is no experiment of a name.
    """
    experiments = {name: load_experiment(name) for name in names or published_experiments()}
    todo = [
        (name, number)
        for name, experiment in experiments.items()
        for number, row in enumerate(experiment.rows)
        if not row.not_covered
    ]
    measured: dict[tuple[str, int], Any] = {}
    open_ = Counter(name for name, _ in todo)

    def finished(name: str) -> tuple[str, list[Reproduced]]:
        experiment = experiments[name]
        return name, [
            _reproduced(experiment, row, measured.get((name, number)))
            for number, row in enumerate(experiment.rows)
        ]

    yield from (finished(name) for name in experiments if not open_[name])
    with workers(jobs) as pool, ProgressDisplay(len(todo), "rows") as display:
        # The longest rows first, as far as it is known, so that none is left for the end.
        todo.sort(key=lambda key: _work(experiments[key[0]], key[1]), reverse=True)
        waiting = {pool.schedule(measure_row, args=(*key,)): key for key in todo}
        for future in as_completed(waiting):
            name, _ = key = waiting[future]
            measured[key] = future.result()
            display.advance()
            open_[name] -= 1
            if not open_[name]:
                yield finished(name)


def _work(experiment: Experiment, number: int) -> float:
    """Estimate, roughly, the steps of a row of searches; those of a solver count many times."""
    protocol, row = experiment.protocol, experiment.rows[number]
    if not isinstance(protocol, Searches):
        return 0.0
    rules = msgspec.structs.replace(protocol, **row.settings)
    steps = row.published.get("mean_iterations", UNKNOWN_ITERATIONS)
    alone = program_of(make_formulation(row.formulation)) is not None
    laws = 2 if row.rival else 1
    return laws * steps * (rules.first or rules.targets) * (OF_A_SOLVER if alone else 1.0)


_Found = tuple[dict[str, Measured], dict[str, Measured] | None]


def measure_row(name: str, number: int) -> _Found | str:
    """Measure a row of an experiment, in a worker; or say why it cannot be."""
    experiment = load_experiment(name)
    try:
        return experiment.measure(experiment.rows[number])
    except DikbenchError as error:
        return str(error)


def _reproduced(experiment: Experiment, row: Row, found: _Found | str | None) -> Reproduced:
    if found is None:
        return Reproduced(row, None, f"not covered: {row.not_covered}")
    if isinstance(found, str):
        return Reproduced(row, None, f"{NOT_MEASURED}: {found}")
    (measured, of_rival), statistics = found, experiment.statistics
    word = verdict(statistics, row.published, measured)
    if experiment.statements:
        word = word.replace(EQUAL, HOLDS).replace(NOT_REPRODUCED, DOES_NOT_HOLD)
    if row.fitted:
        word = f"fitted: {word}"
    if of_rival is not None and word in (EQUAL, INSIDE_NOISE):
        alike = verdict(statistics, row.published, of_rival) in (EQUAL, INSIDE_NOISE)
        word += f"; {'as' if alike else 'not so'} for `{row.rival}`"
    return Reproduced(row, measured, word)


def as_markdown(name: str, reproduced: Iterable[Reproduced]) -> str:
    """Write an experiment and what came of it, with the command that does it again."""
    experiment, rows = load_experiment(name), [*reproduced]
    columns = [
        (key, statistic)
        for key, statistic in experiment.statistics.items()
        if all(not each.row.published for each in rows)
        or any(key in each.row.published for each in rows)
    ]
    heading = ["row", "formulation", *(statistic.heading for _, statistic in columns), "verdict"]
    lines = [
        f"## {name}: {experiment.title}",
        "",
        f"{experiment.source}.",
        "",
        "| " + " | ".join(heading) + " |",
        "|" + "---|" * len(heading),
    ]
    for each in rows:
        cells = [_cell(statistic, key, each) for key, statistic in columns]
        formulation = f"`{each.row.formulation}`" if each.row.formulation else "-"
        name_of_row = each.row.name.replace("|", r"\|")
        lines.append("| " + " | ".join([name_of_row, formulation, *cells, each.verdict]) + " |")
    lines += ["", "```bash", f"dikbench reproduce {name}", "```"]
    for note in experiment.notes:
        lines += ["", note]
    return "\n".join(lines)


def _cell(statistic: Statistic, key: str, each: Reproduced) -> str:
    published = each.row.published.get(key)
    if published is None and each.row.published:
        return ""
    left = "-" if published is None else statistic.text(published)
    if each.measured is None:
        return left
    found = each.measured[key]
    right = statistic.text(found.value)
    if left == right or not found.low < found.high:
        return f"{left} / {right}"
    return f"{left} / {right} ± {statistic.text((found.high - found.low) / 2)}"


def summary(found: dict[str, list[Reproduced]]) -> str:
    """Count the verdicts, on a line."""
    counts: dict[str, int] = {}
    for rows in found.values():
        for each in rows:
            kind = each.verdict.partition(":")[0].partition(";")[0]
            counts[kind] = counts.get(kind, 0) + 1
    return ", ".join(f"{number} {kind}" for kind, number in sorted(counts.items()))


def whole_page(found: dict[str, list[Reproduced]]) -> str:
    """Write all experiments as a page."""
    parts = [
        "# Published tables, reproduced or refuted",
        "Written by `dikbench reproduce --out results/published.md`.",
        EXPLANATION,
        f"Rows: {summary(found)}.",
        *(as_markdown(name, rows) for name, rows in found.items()),
    ]
    return "\n\n".join(parts) + "\n"
