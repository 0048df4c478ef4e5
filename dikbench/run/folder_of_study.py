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
        runs = store.runs()
    except DikbenchError:  # nothing was run in it
        return
    names = {str(run["study"].get("name") or "") for run in runs} - {""}
    if study.name == SELECTED:
        others = {name for name in names if name.startswith(CHECKED)}
    elif study.name in names:
        others = names - {study.name, SELECTED}
    else:
        others = names if study.name else set()
    if others:
        raise DikbenchError(
            f"output folder {folder.path} holds the results of study {min(others)!r}, which those "
            f"of {study.name!r} would be mixed with; valid: another folder with --out"
        )
