"""What a run was made of: versions, machine, study."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

from dikbench.run.workers import available_cores
from dikbench.solvers.catalogue import BACK_ENDS
from dikbench.study import Study

LIBRARIES = (
    "dikbench", "pin", "example-robot-data", "numpy", "scipy", "qpsolvers", "cvxpy", "pandas",
)  # fmt: skip


def manifest(study: Study, trials: int, command: str) -> dict[str, Any]:
    """Describe a run.

    Args:
        study: what was selected.
        trials: number of trials.
        command: the command line, as typed.
    """
    solvers = {name: _version(entry.distribution) for name, entry in BACK_ENDS.items()}
    return {
        "study": msgspec.to_builtins(study),
        "trials": trials,
        "seeds": study.seeds,
        "command": command,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "git_commit": _git_commit(),
        "python": platform.python_version(),
        "system": platform.platform(),
        "cpu": _cpu(),
        "cores": available_cores(),
        "threads_per_worker": 1,
        "libraries": {name: _version(name) for name in LIBRARIES},
        "solvers": {name: version for name, version in solvers.items() if version},
    }


def _version(distribution: str) -> str | None:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


def _cpu() -> str:
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _git_commit() -> str | None:
    """The commit of the checkout that dikbench runs from, "+" where it has changes; else None."""
    try:
        _git(
            "ls-files", "--error-unmatch", Path(__file__).name
        )  # not a wheel inside somebody's checkout
        return _git("rev-parse", "HEAD") + ("+" if _git("status", "--porcelain", "-uno") else "")
    except (OSError, subprocess.SubprocessError):
        return None


def _git(*arguments: str) -> str:
    return subprocess.run(
        ["git", "-C", str(Path(__file__).parent), *arguments],
        capture_output=True,
        text=True,
        timeout=10,
        check=True,
        env={**os.environ, "GIT_OPTIONAL_LOCKS": "0"},
    ).stdout.strip()
