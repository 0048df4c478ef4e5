"""What a worker on another machine must share with the driver, so that its rows are the driver's.

A worker that is forked or started by the driver has its files; one elsewhere may have others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from dikbench.errors import DikbenchError
from dikbench.metrics import described, other_metrics
from dikbench.results.versions import differences
from dikbench.run.provenance import environment, git_commit
from dikbench.study.identity import sources_of
from dikbench.study.trial import Trial


class OtherWorker(Exception):
    """A worker has other versions or sources than the driver; the message says which."""


@dataclass(frozen=True)
class Expected:
    """What a worker must have.

    Attributes:
        environment: the description of the driver (see `environment`).
        sources: hashes of the sources of some trials (see `sources_of`).
        metrics: descriptions of metrics of other authors.
    """

    environment: Mapping[str, Any]
    sources: Mapping[str, str]
    metrics: Mapping[str, Mapping[str, Any]]


def as_expected(
    expected: Expected,
    trials: Sequence[Trial],
    metrics: Sequence[str],
    function: Callable[..., Any],
    *arguments: Any,
) -> Any:
    """Call a function in a worker process that has what the driver expects of it.

    Raises:
        OtherWorker: if it has not.
    """
    if lacking := _differing(expected, trials, metrics):
        raise OtherWorker(lacking)
    return function(*arguments)


def _differing(expected: Expected, trials: Sequence[Trial], metrics: Sequence[str]) -> str:
    """Say what differs between the driver and this process; an empty text where nothing does."""
    solvers = {trial.solver.name for trial in trials}
    if found := differences(expected.environment, _own_environment(), sorted(solvers)):
        return f"here and there differ: {', '.join(found)}"
    try:
        sources = sources_of(trials)
        own_metrics = described(other_metrics(metrics))
    except DikbenchError as error:
        return str(error)
    names = [name for name, text in expected.sources.items() if sources.get(name) != text]
    names += [
        f"metric {name}" for name, each in expected.metrics.items() if own_metrics.get(name) != each
    ]
    return f"it has another source of {', '.join(names)}" if names else ""


@lru_cache(maxsize=1)
def _own_environment() -> dict[str, Any]:
    return environment(git_commit(), "")
