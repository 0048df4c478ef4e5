"""Runs on a cluster of two workers, which are killed, refused, and lose their scheduler."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pandas as pd
import pytest
from makers.clusters import Cluster, cluster
from makers.runs import run_here
from makers.short_study import STUDY, table

from dikbench.errors import DikbenchError
from dikbench.results.reading import load_results
from dikbench.results.store import Store
from dikbench.run.blocks import Engine
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import run_study, status_of
from dikbench.study.study import Cells, Study, load_study

pytest.importorskip("distributed")
pytestmark = [
    pytest.mark.long,
    # Of clients whose scheduler or workers were killed.
    pytest.mark.filterwarnings("ignore"),
]

MANY: Study = msgspec.structs.replace(STUDY, seeds=tuple(range(5)))

LAWS = '''
import os, signal, time
from dataclasses import dataclass

@dataclass(frozen=True)
class Kills:
    """Ends the worker of the cluster whose process this is a child of."""

    def velocity(self, problem, solve):
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(60)

@dataclass(frozen=True)
class Sleeps:
    def velocity(self, problem, solve):
        time.sleep(600)

@dataclass(frozen=True)
class Grows:
    def velocity(self, problem, solve):
        return bytes(2**33)[0] * problem.v_prev

@dataclass(frozen=True)
class Ends:
    def velocity(self, problem, solve):
        os._exit(3)
'''


def _on(cluster: Cluster, engine: Engine = "alone", **how: Any) -> RunSettings:
    return RunSettings(1, engine=engine, scheduler=str(cluster.file), **how)


def _when_rows_are_there(out: Path, number: int, act: Callable[[], object]) -> threading.Thread:
    """Do something as soon as a run has committed some rows."""

    def watch() -> None:
        while True:
            time.sleep(0.05)
            if (out / "results.sqlite").exists():
                try:
                    with Store(out / "results.sqlite") as store:
                        if len(store.statuses()) >= number:
                            break
                except DikbenchError:
                    continue
        act()

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    return thread


def _assert_same_rows(folder: Path) -> None:
    found, expected = (table(folder / name) for name in ("out", "one"))
    pd.testing.assert_frame_equal(found, expected, check_exact=True)


@pytest.mark.parametrize("engine", ["alone", "lockstep"])
def test_a_worker_is_killed_and_the_rows_are_those_of_one_process(
    tmp_path: Path, engine: Engine, capsys: pytest.CaptureFixture[str]
) -> None:
    """Bit for bit in every physical column and trace; its processes end with it."""
    run_here(MANY, tmp_path / "one", RunSettings(1, engine=engine), "one process")
    with cluster(tmp_path, [tmp_path / "a", tmp_path / "b"]) as made:
        victim = made.processes[1]
        kill = _when_rows_are_there(tmp_path / "out", 3, victim.kill)
        run_study(MANY, tmp_path / "out", _on(made, engine), "on a cluster")
        kill.join()
        assert victim.wait() == -signal.SIGKILL
    pd.testing.assert_frame_equal(
        table(tmp_path / "out"), table(tmp_path / "one"), check_exact=True
    )
    names = sorted(path.name for path in (tmp_path / "one" / "traces").iterdir())
    assert names == sorted(path.name for path in (tmp_path / "out" / "traces").iterdir())
    for name in names:
        traces = [tmp_path / folder / "traces" / name for folder in ("one", "out")]
        assert traces[0].read_bytes() == traces[1].read_bytes()
    if engine == "alone":  # in lockstep it may have had nothing left to do
        assert "is lost" in capsys.readouterr().err


def test_what_goes_wrong_on_a_worker_is_the_row_of_one_trial(tmp_path: Path) -> None:
    """Time, memory, a process that ends; a trial that ends two workers of the cluster is crashed.

    The nannies start workers anew.
    """
    (tmp_path / "laws.py").write_text(LAWS)
    names = ("Kills", "Sleeps", "Grows", "Ends")
    laws = tuple(f"{tmp_path / 'laws.py'}:{name}" for name in names)
    study = msgspec.structs.replace(
        STUDY,
        cells=(Cells((*laws, "dls", "pinv")),),
        scenarios=STUDY.scenarios[:1],
        seeds=(0, 1, 2),
    )
    with cluster(tmp_path) as made:
        for folder in ("a", "b"):
            made.add_worker(tmp_path / folder, "--nanny")
        made.wait_for_workers(2)
        settings = _on(made, trial_timeout=10.0, trial_memory=2048)
        run_study(study, tmp_path / "out", settings, "on a cluster")
    trials = load_results(tmp_path / "out").trials
    found = {
        name: sorted(set(rows["status"] + ": " + rows["message"]))
        for name, rows in trials.groupby(trials["formulation"].str.rpartition(":")[2])
    }
    assert found == {
        "Kills": ["crashed: the trial ended 2 workers of the cluster"],
        "Sleeps": ["timeout: not finished after 10 s"],
        "Grows": ["out-of-memory: step 0: MemoryError: "],
        "Ends": ["crashed: the worker ended with exit code 3"],
        "dls": ["ok: "],
        "pinv": ["ok: "],
    }


def test_a_worker_with_another_source_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is named with the difference, and the other one does all; alone it ends the run."""
    law = (
        "from dataclasses import dataclass\n@dataclass(frozen=True)\nclass Law:\n"
        "    def velocity(self, problem, solve):\n        return {} * problem.v_prev\n"
    )
    for folder, factor in (("here", 0.0), ("same", 0.0), ("other", 1.0)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "law.py").write_text(law.format(factor))
    study = msgspec.structs.replace(
        STUDY, cells=(Cells(("law.py:Law",)),), scenarios=STUDY.scenarios[:1], seeds=(0, 1, 2, 3)
    )
    monkeypatch.chdir(tmp_path / "here")
    with cluster(tmp_path, [tmp_path / "other"]) as made:
        with pytest.raises(DikbenchError) as caught:
            run_study(study, tmp_path / "out", _on(made), "on a cluster")
        assert "it has another source of formulation law.py:Law" in str(caught.value)
        assert "\n" not in str(caught.value)
        capsys.readouterr()
        made.add_worker(tmp_path / "same", "--no-nanny")
        made.wait_for_workers(2)
        run_study(study, tmp_path / "out", _on(made), "on a cluster")
    assert status_of(tmp_path / "out") == {"ok": 4}
    assert "is refused: it has another source of formulation law.py:Law" in capsys.readouterr().err


SCRIPT = """
import sys
from dikbench.cli import main
if __name__ == "__main__":
    sys.argv = ["dikbench", *sys.argv[1:]]
    main()
"""


def test_a_lost_scheduler_ends_the_run_in_one_line(tmp_path: Path) -> None:
    """Rows that came back are kept, and the same command with another scheduler does the rest."""
    written = {name: value for name, value in msgspec.to_builtins(MANY).items() if value}
    (tmp_path / "study.toml").write_bytes(msgspec.toml.encode(written))
    (tmp_path / "script.py").write_text(SCRIPT)
    study = load_study(str(tmp_path / "study.toml"))
    run_here(study, tmp_path / "one", RunSettings(1), "one process")
    command = [
        *(sys.executable, "script.py", "run", "study.toml", "--out", "out", "--executor", "dask"),
        *("--engine", "alone", "--scheduler", "scheduler.json"),
    ]
    for losing in (True, False):
        with cluster(tmp_path, [tmp_path / "a"]) as made:
            if losing:
                _when_rows_are_there(tmp_path / "out", 2, made.scheduler.kill)
            done = subprocess.run(
                command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
            )
        made.file.unlink(missing_ok=True)
        if losing:
            lines = [line for line in done.stderr.splitlines() if not line.startswith("trials: ")]
            assert len(lines) == 1, lines
            [said] = lines
            assert said.startswith("error: scheduler scheduler.json is lost; rows")
            assert done.returncode == 2
            assert 2 <= status_of(tmp_path / "out")["ok"] < len(table(tmp_path / "one"))
        else:
            assert done.returncode == 0, done.stderr
    pd.testing.assert_frame_equal(
        table(tmp_path / "out"), table(tmp_path / "one"), check_exact=True
    )


def _children(process: int) -> list[str]:
    of = f"\nPPid:\t{process}\n"
    found = [path.parent for path in Path("/proc").glob("[0-9]*/status") if of in _text(path)]
    commands = [_text(folder / "cmdline") for folder in found]
    return [text for text in commands if "resource_tracker" not in text]  # of Python itself


def _text(path: Path) -> str:
    try:
        return path.read_text(errors="replace")
    except OSError:  # it ended
        return ""


def test_nothing_is_left_on_the_workers(tmp_path: Path) -> None:
    """After a run, the worker has no process of ours."""
    with cluster(tmp_path, [tmp_path / "a"]) as made:
        run_study(STUDY, tmp_path / "out", _on(made), "on a cluster")
        left = _children(made.processes[1].pid)
    assert left == []
