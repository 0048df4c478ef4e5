"""A dask cluster of this machine: a scheduler and workers, each a process of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

SECONDS_TO_START = 120


class Cluster:
    """A scheduler that wrote its file, and workers that may be added."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "scheduler.json"
        self.processes: list[subprocess.Popen[bytes]] = []
        self.scheduler = self._start(folder, "scheduler", "--port", "0", "--host", "127.0.0.1")

    def add_worker(self, cwd: Path, *options: str) -> subprocess.Popen[bytes]:
        """Start a worker of one thread in a folder, without a nanny unless the options say so."""
        cwd.mkdir(exist_ok=True, parents=True)
        return self._start(cwd, "worker", "--nthreads", "1", "--death-timeout", "60", *options)

    def wait_for_workers(self, count: int) -> None:
        """Wait until so many have registered."""
        from distributed import Client

        with Client(scheduler_file=str(self.file), set_as_default=False) as client:
            client.wait_for_workers(count, timeout=SECONDS_TO_START)

    def _start(self, cwd: Path, what: str, *options: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", what, "--scheduler-file", str(self.file)]
        process = subprocess.Popen(
            [*command, "--no-dashboard", *options],
            cwd=cwd,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self.processes.append(process)
        return process

    def end(self) -> None:
        """End all of its processes, and theirs."""
        for process in self.processes:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()


@contextmanager
def cluster(folder: Path, workers: Sequence[Path] = ()) -> Iterator[Cluster]:
    """Start a scheduler, and workers in folders."""
    made = Cluster(folder)
    try:
        deadline = time.monotonic() + SECONDS_TO_START
        while not made.file.exists():
            assert time.monotonic() < deadline
            time.sleep(0.1)
        for each in workers:
            made.add_worker(each, "--no-nanny")
        if workers:
            made.wait_for_workers(len(workers))
        yield made
    finally:
        made.end()
