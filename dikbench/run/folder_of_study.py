"""The results folder of one study: another one is kept out of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from dikbench.errors import DikbenchError
from dikbench.results.folder import ResultsFolder
from dikbench.results.store import Store
from dikbench.study.study import CHECKED, SELECTED, Study


@contextmanager
def store_for(folder: ResultsFolder, study: Study) -> Iterator[Store]:
    """Open the store of a folder for a study, and keep other runs out meanwhile.

    Raises:
        DikbenchError: if the folder cannot be written, another run uses it, or it holds the results
            of another study.
    """
    with folder.lock(), Store(folder.database) as store:
        _check_same(folder, store, study)
        yield store


def _check_same(folder: ResultsFolder, store: Store, study: Study) -> None:
    """Check that the rows of a study may stand beside those of the folder.

    What was selected by options may be added to any study but one that was run with straw laws; a
    study is not added to what was selected.
    """
    try:
        there = str(store.manifest()["study"].get("name") or "")
    except DikbenchError:  # nothing was run in it
        return
    names = {there, study.name}
    alone = study.name != SELECTED or any(name.startswith(CHECKED) for name in names)
    if "" not in names and len(names) > 1 and alone:
        raise DikbenchError(
            f"output folder {folder.path} holds the results of study {there!r}, which those of "
            f"{study.name!r} would be mixed with; valid: another folder with --out"
        )
