"""One thread for linear algebra; bytecode for the many processes; workers; no limits of time."""

from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, settings

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before numpy is imported

# Hundreds of processes start; without bytecode each would compile dikbench and Pinocchio again,
# which takes longer than all else that it does.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# No test asserts a time: Hypothesis would, and a machine may be busy with something else.
settings.register_profile("random", deadline=None, suppress_health_check=[HealthCheck.too_slow])
# A commit that passes passes again: the examples follow from the test; `make test-random` draws.
settings.register_profile("repeatable", settings.get_profile("random"), derandomize=True)
settings.load_profile("repeatable")

MOST_WORKERS = 4
"""Each takes 0.6 GB."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Share the tests among a worker per core; a file or `-k` is not worth their start."""
    selected = config.option.keyword or any(".py" in given for given in config.args)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return 0 if selected else min(cores or 1, MOST_WORKERS)
