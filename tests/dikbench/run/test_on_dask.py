"""The executor of a cluster, on one that is played: workers come, go and lie at any time."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.commands import in_process

from dikbench.errors import DikbenchError
from dikbench.results.folder import ResultsFolder
from dikbench.run import dask_client
from dikbench.run import on_dask as module
from dikbench.run.block_work import Block, BlockSettings
from dikbench.run.blocks import Engine
from dikbench.run.in_workers import _run_blocks
from dikbench.run.on_dask import OnDask
from dikbench.run.same_as_driver import Expected, OtherWorker, as_expected
from dikbench.run.trial_row import TrialRow
from dikbench.study.plan import PlannedTrial
from dikbench.study.trial import Trial

pytest.importorskip("distributed")
from dikbench.run.dask_worker import Answer, Made

HOW = BlockSettings("lockstep", 1.0, 1, "all", None, "", ())


class _Future:
    """What the executor asks of a future of dask."""

    def __init__(self) -> None:
        self.status = "pending"
        self.answer: Any = None
        self.told: list[Callable[[Any], object]] = []

    def add_done_callback(self, tell: Callable[[Any], object]) -> None:
        self.told.append(tell)

    def cancel(self) -> None:
        self.end("cancelled", None)

    def result(self, timeout: float) -> Any:
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer

    def end(self, status: str, answer: Any) -> None:
        self.status, self.answer = status, answer
        for tell in self.told:
            tell(self)


class _Cluster:
    """A client of a cluster whose workers run what they are told to; killers end them.

    Args:
        draw: draws a number below another one.
        killers: ids of trials that end their worker.
        losses: so many workers are lost for no reason.
    """

    status = "running"

    def __init__(self, draw: Callable[[int], int], killers: set[str], losses: int) -> None:
        self.draw = draw
        self.killers = killers
        self.losses = losses
        self.workers: dict[str, list[tuple[_Future, list[Block]]]] = {}
        self.threads: dict[str, int] = {}
        self.started = 0
        self.ended_by: Counter[str] = Counter()
        self.scheduler = self
        self.ncores = None

    def start(self, threads: int) -> None:
        self.started += 1
        self.workers[f"w{self.started}"] = []
        self.threads[f"w{self.started}"] = threads

    def sync(self, function: object, callback_timeout: float) -> dict[str, int]:
        self.step()
        return dict(self.threads)

    def submit(
        self,
        function: object,
        run: str,
        blocks: list[Block],
        *rest: Any,
        workers: list[str],
        **how: Any,
    ) -> _Future:
        future = _Future()
        self.workers.get(workers[0], []).append((future, blocks))  # or to one that is lost
        return future

    def step(self) -> None:
        """Have some worker do something."""
        busy = [name for name, tasks in self.workers.items() if tasks]
        if not busy:
            return
        name = busy[self.draw(len(busy))]
        tasks = self.workers[name]
        future, blocks = tasks[self.draw(min(len(tasks), self.threads[name]))]
        done = 1 + self.draw(len(blocks))  # there is no time for the others
        killer = [p.id for block in blocks[:done] for p in block if p.id in self.killers]
        if killer or (self.losses and self.draw(3) == 0):
            self.losses -= not killer
            self.ended_by.update(killer)
            self.start(self.threads[name])
            del self.workers[name], self.threads[name]
            return
        tasks.remove((future, blocks))
        made: list[Made | None] = [None] * len(blocks)
        for place, block in enumerate(blocks[:done]):
            made[place] = [{"status": "ok", "id": p.id} for p in block], {}
        future.end("finished", Answer(made))


def _block(number: int, size: int) -> Block:
    trials = [
        Trial.of(formulation=f"dls[damping={1e-3 * (k + 1):g}]", scenario="reach", seed=number)
        for k in range(size)
    ]
    return [PlannedTrial(f"{number}-{k}", trial) for k, trial in enumerate(trials)]


def _executor(client: Any, folder: Path, engine: Engine = "lockstep") -> OnDask:
    return OnDask(client, "tcp://played", ResultsFolder(folder), replace(HOW, engine=engine))


@pytest.fixture(autouse=True)
def _at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SECONDS_BETWEEN_LOOKS", 0.0)
    monkeypatch.setattr(module, "environment", lambda commit, command: {})


@settings(max_examples=60)
@given(
    sizes=st.one_of(
        st.lists(st.integers(1, 4), min_size=1, max_size=12),  # in lockstep
        st.lists(st.just(1), min_size=1, max_size=60),
    ),
    threads=st.lists(st.integers(1, 3), min_size=1, max_size=3),
    losses=st.integers(0, 1),
    killers=st.sets(st.integers(0, 30), max_size=3),
    random=st.randoms(use_true_random=False),
)
def test_every_trial_has_one_row_whatever_becomes_of_the_workers(
    sizes: list[int], threads: list[int], losses: int, killers: set[int], random: Any
) -> None:
    """Crashed are those that end workers, and no others: not what was beside them."""
    blocks = [_block(number, size) for number, size in enumerate(sizes)]
    trials = [p.id for block in blocks for p in block]
    guilty = {trials[k] for k in killers if k < len(trials)}
    client = _Cluster(random.randrange, guilty, losses)
    for number in threads:
        client.start(number)
    executor = _executor(client, Path("nowhere"), "alone" if set(sizes) == {1} else "lockstep")
    found = [
        (p.id, row["status"]) for some in _run_blocks(deque(blocks), executor) for p, row in some
    ]
    assert sorted(name for name, _ in found) == sorted(trials)
    assert {name for name, status in found if status == "crashed"} == guilty
    assert all(client.ended_by[name] >= module.MOST_LOSSES for name in guilty)


def test_a_trial_alone_ends_two_workers_and_no_more(tmp_path: Path) -> None:
    """It is not run a third time."""
    client = _Cluster(lambda below: 0, {"0-0"}, 0)
    client.start(1)
    executor = _executor(client, tmp_path)
    [[(_, row)]] = list(_run_blocks(deque([_block(0, 1)]), executor))
    assert row["status"] == "crashed"
    assert row["message"] == "the trial ended 2 workers of the cluster"
    assert client.ended_by == {"0-0": 2}


class _Answering(_Cluster):
    """A cluster of which each worker answers in its own way."""

    answers: dict[str, Any]

    def step(self) -> None:
        for name, tasks in self.workers.items():
            while tasks:
                future, blocks = tasks.pop()
                rows: list[list[TrialRow]] = [[{"status": "ok"} for _ in each] for each in blocks]
                traces = [{p.id: b"x" for p in each} for each in blocks]
                done = Answer([*zip(rows, traces, strict=True)])
                answer = done if self.answers[name] is None else self.answers[name]
                future.end("error" if isinstance(answer, Exception) else "finished", answer)


@pytest.mark.parametrize(
    "answer", [Answer([None], "numpy 1 and 2"), ModuleNotFoundError("no numpy 1 and 2")]
)
def test_a_worker_that_is_refused_gets_nothing_more(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], answer: Any
) -> None:
    """Others do its blocks; where there are none, the run ends, with the reason."""
    folder = ResultsFolder(tmp_path)
    folder.traces.mkdir()
    client = _Answering(lambda below: 0, set(), 0)
    client.answers = {"w1": answer, "w2": None}
    client.start(1)
    blocks = [_block(number, 2) for number in range(5)]
    with pytest.raises(DikbenchError, match=r"no worker can be used.*numpy 1 and 2"):
        list(_run_blocks(deque(blocks), _executor(client, tmp_path)))
    client.start(1)
    made = list(_run_blocks(deque(blocks), _executor(client, tmp_path)))
    assert sum(map(len, made)) == 10
    assert capsys.readouterr().err.count("w1 is refused") == 2
    assert folder.trace("4-1").read_bytes() == b"x"


def test_a_lost_scheduler_is_one_line(tmp_path: Path) -> None:
    """Whether it is gone, or does not answer."""
    client = _Cluster(lambda below: 0, set(), 0)
    for fault in (OSError("gone"), TimeoutError()):

        def ask(*given: Any, fault: Exception = fault, **how: Any) -> Any:
            raise fault

        client.sync = ask  # type: ignore[method-assign]
        executor = _executor(client, tmp_path)
        executor.give(_block(0, 1))
        with pytest.raises(DikbenchError, match="tcp://played is lost; rows that came back"):
            executor.finished()


def _environment(**changes: Any) -> dict[str, Any]:
    from dikbench.run.same_as_driver import _own_environment

    return {**_own_environment(), **changes}


def test_a_worker_says_what_differs() -> None:
    """Versions, a solver's where it is used, sources, metrics; or it does what it is asked."""
    from dikbench.study.identity import sources_of

    trials = [Trial.of("dls", "reach"), Trial.of("qp", "reach", "daqp")]
    sources = sources_of(trials)
    own = _environment()

    def asked(expected: Expected) -> str:
        try:
            return str(as_expected(expected, trials, (), str.upper, "done"))
        except OtherWorker as other:
            return str(other)

    assert asked(Expected(own, sources, {})) == "DONE"
    libraries = {**own["libraries"], "numpy": "1.0"}
    said = asked(Expected(_environment(libraries=libraries), sources, {}))
    assert said == f"here and there differ: numpy 1.0 and {own['libraries']['numpy']}"
    for solver, refused in (("daqp", True), ("osqp", False)):
        solvers = {**own["solvers"], solver: "0.0"}
        said = asked(Expected(_environment(solvers=solvers), sources, {}))
        assert (f"{solver} 0.0 and" in said) == refused
    said = asked(Expected(own, {**sources, "formulation dls": "x"}, {}))
    assert said == "it has another source of formulation dls"
    assert asked(Expected(own, sources, {"mine": {}})) == "it has another source of metric mine"


def test_code_that_a_worker_lacks_is_named() -> None:
    """A file that is not there."""
    trial = Trial.of("nowhere.py:Law", "reach")
    expected = Expected(_environment(), {}, {})
    with pytest.raises(OtherWorker, match=r"file not found: nowhere\.py"):
        as_expected(expected, [trial], (), str)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--executor", "dask"), "needs a scheduler; valid: its address, such as tcp://host:8786"),
        (("--scheduler", "tcp://x:1"), "is for executor dask"),
        (("--executor", "ray"), "ray"),
        (("--executor", "dask", "--scheduler", "none.json"), "none.json cannot be reached"),
        (("--executor", "dask", "--scheduler", "text.json"), "text.json cannot be reached"),
        (("--executor", "dask", "--scheduler", "list.json"), "list.json cannot be reached"),
        (("--executor", "dask", "--scheduler", "tcp://127.0.0.1:1"), "cannot be reached"),
        (("--executor", "dask", "--scheduler", "nonsense://"), "cannot be reached"),
    ],
)
def test_a_wrong_scheduler_is_one_line(
    options: tuple[str, ...], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is run."""
    monkeypatch.setattr(dask_client, "SECONDS_OF_CONNECTION", 0.5)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.json").write_text("tcp")
    (tmp_path / "list.json").write_text("[1]")
    study = ("--formulation", "dls", "--scenario", "reach[duration=0.2]", "--plant", "ideal")
    done = in_process("run", *study, *options, "--out", str(tmp_path / "out"))
    assert done.exit_code == 2, done.output
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert not list((tmp_path / "out").glob("traces/*"))
