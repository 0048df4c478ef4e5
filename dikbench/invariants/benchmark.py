"""The check of a study: run with straw laws and oracles, it must keep all invariants."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

from dikbench.invariants.of_rows import INVARIANTS
from dikbench.results.reading import read_results, without_attributes
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import run_study
from dikbench.scenario.oracle import ORACLES
from dikbench.study.study import CHECKED, Cells, Study
from dikbench.testing import straw


@dataclass(frozen=True)
class Checked:
    """An invariant and the places where a study breaks it, in words."""

    sentence: str
    broken: tuple[str, ...]


def with_straw_laws(study: Study) -> Study:
    """Return the study with the straw laws and the oracles as further formulations, renamed.

    Whatever its split, since nothing is concluded from it.
    """
    file = Path(straw.__file__)
    laws = tuple(f"{file}:{law.__name__}" for law in straw.STRAW_LAWS)
    cells = (*study.cells, Cells((*ORACLES, *laws)))
    name = f"{CHECKED}{study.name}"
    return msgspec.structs.replace(study, name=name, cells=cells, timing=None, split="")


def check_benchmark(
    study: Study, out: Path, settings: RunSettings, command: str
) -> Iterator[Checked]:
    """Run a study with straw laws, and check every invariant on its rows.

    Args:
        study: the study.
        out: results folder; what it holds already is not run again.
        settings: how it is run.
        command: the command line, for the manifest.

    Raises:
        DikbenchError: as `run_study`.
    """
    run_study(with_straw_laws(study), out, settings, command)
    rows = without_attributes(read_results(out)).trials
    for invariant in INVARIANTS:
        yield Checked(invariant.sentence, tuple(invariant.broken(rows)))
