"""The provenance of results: machine, versions, commit, command."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from dikbench.run.pool import THREAD_VARIABLES, available_cores
from dikbench.solvers.catalogue.back_ends import BACK_ENDS
from dikbench.study.study import Study

LIBRARIES = (
    "dikbench", "pin", "example-robot-data", "numpy", "scipy", "qpsolvers", "cvxpy", "pandas",
)  # fmt: skip


def environment(commit: str | None, command: str) -> dict[str, Any]:
    """Describe this process; every row refers to the description of its worker.

    Args:
        commit: see `git_commit`.
        command: the command line, as typed.
    """
    solvers = {name: _version(entry.package) for name, entry in BACK_ENDS.items()}
    return {
        "command": command,
        "git_commit": commit,
        "python": platform.python_version(),
        "system": platform.platform(),
        "cpu": _cpu(),
        "governor": _governor(),
        "cores": available_cores(),
        "threads": {name: os.environ.get(name) for name in THREAD_VARIABLES},
        "blas": _blas(),
        "libraries": {name: _version(name) for name in LIBRARIES},
        "solvers": {name: version for name, version in solvers.items() if version},
    }


def manifest(study: Study, trials: int, description: dict[str, Any]) -> dict[str, Any]:
    """Describe a run.

    Args:
        study: what was selected.
        trials: number of trials.
        description: the environment of the driver.
    """
    return {
        "study": msgspec.to_builtins(study),
        "trials": trials,
        "seeds": list(study.seeds),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        **description,
    }


def git_commit() -> str | None:
    """Return the commit of the checkout in use, with "+" where it has changes; else None."""
    try:
        # A wheel inside another checkout is not part of it.
        _git("ls-files", "--error-unmatch", Path(__file__).name)
        return _git("rev-parse", "HEAD") + ("+" if _git("status", "--porcelain", "-uno") else "")
    except (OSError, subprocess.SubprocessError):
        return None


def _version(distribution: str) -> str | None:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


def _cpu() -> str:
    for line in _text("/proc/cpuinfo").splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _governor() -> str | None:
    return _text("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor").strip() or None


def _text(path: str) -> str:
    try:
        return Path(path).read_text(errors="replace")
    except OSError:  # not on this system
        return ""


def _blas() -> str:
    found: Any = np.show_config(mode="dicts")
    blas = found.get("Build Dependencies", {}).get("blas", {})
    return f"{blas.get('name', 'unknown')} {blas.get('version', '')}".strip()


def _git(*arguments: str) -> str:
    return subprocess.run(
        ["git", "-C", str(Path(__file__).parent), *arguments],
        capture_output=True,
        text=True,
        timeout=10,
        check=True,
        env={**os.environ, "GIT_OPTIONAL_LOCKS": "0"},
    ).stdout.strip()
