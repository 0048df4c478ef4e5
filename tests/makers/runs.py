"""Studies whose trials run in the process of the test: a worker takes seconds to start."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import msgspec
import pytest

from dikbench.report import write
from dikbench.report.interactive import replays
from dikbench.results.folder import ResultsFolder
from dikbench.run import on_this_machine, recompute, runner
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import run_study
from dikbench.study.study import Study, TimingSettings

UNEQUAL: Final = ["wall_time_s", "control_time_s", "described"]
"""What may differ between two runs of the same trials."""


class _NoPool:
    """What the harness asks of its pool of workers, done at once."""

    def schedule(
        self, function: Callable[..., Any], args: tuple[Any, ...] = (), timeout: float | None = None
    ) -> Future[Any]:
        """Call a function, and return its result or its error; nothing limits its time."""
        done: Future[Any] = Future()
        try:
            done.set_result(function(*args))
        except Exception as error:
            done.set_exception(error)
        return done


@contextmanager
def _no_workers(*given: object) -> Iterator[_NoPool]:
    yield _NoPool()


@contextmanager
def without_workers() -> Iterator[None]:
    """Have the harness run, time, recompute and replay trials in this process meanwhile."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (on_this_machine, runner, recompute, replays):
            patch.setattr(module, "workers", _no_workers)
        yield


@contextmanager
def not_played() -> Iterator[None]:
    """Have reports made without what is played: half of their time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(write, "embed", lambda *given: None)
        yield


@contextmanager
def without_figures() -> Iterator[None]:
    """Have reports made without their figures and what is played: most of their time."""
    with not_played(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(write, "draw_figures", lambda *given: [])
        yield


def run_here(study: Study, out: Path, settings: RunSettings, command: str) -> ResultsFolder:
    """Run a study as `run_study` does, without workers."""
    with without_workers():
        return run_study(study, out, settings, command)


def briefly_timed(study: Study) -> Study:
    """Make the same study, whose timing pass takes a few times only."""
    return msgspec.structs.replace(study, timing=TimingSettings("dls", problems=10, rounds=2))
