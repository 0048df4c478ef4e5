"""A results folder: the store, its exports, the traces."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

from filelock import FileLock, Timeout

from dikbench.errors import DikbenchError
from dikbench.results.exports import MANIFEST, PARQUET, TRIALS
from dikbench.results.store import Store


class ResultsFolder:
    """A folder to which a run writes.

    Attributes:
        path: the folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.absolute()

    @property
    def traces(self) -> Path:
        """The folder of traces, one file per trial."""
        return self.path / "traces"

    def trace(self, trial: str) -> Path:
        """Return the file of a trial's trace, by the trial's id."""
        return self.traces / f"{trial}.arrow"

    @property
    def database(self) -> Path:
        """The file of the store."""
        return self.path / "results.sqlite"

    def lock(self) -> FileLock:
        """Keep other runs out of the folder, making it where it is missing.

        Raises:
            DikbenchError: if it cannot be written, or another run uses it.
        """
        try:
            self.traces.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = error.strerror or str(error)
            raise DikbenchError(f"output folder {self.path} cannot be written: {reason}") from None
        if not os.access(self.path, os.W_OK | os.X_OK) or not os.access(self.traces, os.W_OK):
            raise DikbenchError(f"output folder {self.path} cannot be written: permission denied")
        lock = FileLock(self.path / "run.lock")
        try:
            lock.acquire(timeout=0)
        except Timeout:
            raise DikbenchError(
                f"output folder {self.path}: another run is at work in it; wait for it or choose "
                "another folder with --out"
            ) from None
        except OSError as error:
            reason = error.strerror or str(error)
            raise DikbenchError(f"output folder {self.path} cannot be locked: {reason}") from None
        return lock

    def check_there(self) -> None:
        """Check that there are results.

        Raises:
            DikbenchError: if there are none.
        """
        if not self.database.is_file():
            raise DikbenchError(f"no results in {self.path}: {self.database.name} is missing")

    def open_store(self, *, add_metrics: bool = False) -> Store:
        """Open the store, which must exist.

        Args:
            add_metrics: see `Store`.

        Raises:
            DikbenchError: if there is none, or it cannot be read.
        """
        self.check_there()
        return Store(self.database, add_metrics=add_metrics)

    def export(self, store: Store) -> None:
        """Write the trials as CSV and Parquet, the times as CSV, and the manifest.

        Raises:
            DikbenchError: if they cannot be written.
        """
        trials = store.trials()
        try:
            times = store.times()
            text = json.dumps(store.manifest(), indent=2, ensure_ascii=False) + "\n"
            _replace(self.path / TRIALS, lambda file: trials.to_csv(file, index=False))
            _replace(self.path / "timing.csv", lambda file: times.to_csv(file, index=False))
            _replace(self.path / PARQUET, lambda file: trials.to_parquet(file, index=False))
            _replace(self.path / MANIFEST, lambda file: file.write_text(text))
        except OSError as error:
            reason = error.strerror or str(error)
            raise DikbenchError(
                f"output folder {self.path}: {reason}; the store keeps what was committed"
            ) from None


def _replace(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file and move it into place."""
    partial = path.with_name(path.name + ".partial")
    write(partial)
    partial.replace(path)
