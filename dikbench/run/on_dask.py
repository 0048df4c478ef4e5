"""Blocks of trials on the workers of a dask cluster; rows come back to the one writer.

Each block is pinned to a worker, so that it is known what ran on one that is lost. What did runs
again, alone on a worker: a trial that loses that one too is `crashed`.
"""

from __future__ import annotations

import queue
import sys
import time
import uuid
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any, Final

from dikbench.errors import DikbenchError
from dikbench.metrics import described, other_metrics
from dikbench.results.folder import ResultsFolder
from dikbench.run.block_work import Block, BlockSettings, Finished
from dikbench.run.dask_client import SECONDS_OF_CONNECTION, connected
from dikbench.run.provenance import environment
from dikbench.run.same_as_driver import Expected
from dikbench.run.trial_row import CannotStore, row_without_run
from dikbench.simulation.status import Status
from dikbench.study.identity import sources_of

AHEAD: Final = 2
"""So many bundles of blocks for each thread of a worker: one that runs, one that waits."""

MOST_ALONE: Final = 16
"""So many trials that run alone are in a bundle: each bundle costs the driver milliseconds."""

SECONDS_BETWEEN_LOOKS: Final = 0.5
"""How often it is asked which workers there are."""

MOST_LOSSES: Final = 2
"""A trial that loses so many workers, the last one while it was alone on it, is not run again."""


@dataclass(eq=False)
class Seat:
    """A worker of the cluster.

    Attributes:
        address: where it is.
        threads: number of bundles of blocks that it runs at a time.
        bundles: those that were given to it, by their futures' keys, in their order.
        reserved: whether it runs one block alone, or waits for it.
    """

    address: str
    threads: int
    bundles: dict[str, tuple[Any, list[Block]]] = field(default_factory=dict)
    reserved: bool = False


class OnDask:
    """An executor of the workers of a cluster.

    Args:
        client: connected to its scheduler.
        address: of the scheduler, as it was given.
        folder: where traces are kept.
        how: how blocks are run.
    """

    def __init__(
        self, client: Any, address: str, folder: ResultsFolder, how: BlockSettings
    ) -> None:
        from dikbench.run.dask_worker import run_blocks

        self.run = uuid.uuid4().hex
        self._run_blocks = run_blocks
        self._client = client
        self._address = address
        self._folder = folder
        self._how = how
        own = environment(how.commit, how.command)
        self._expected = Expected(own, {}, described(other_metrics(how.metrics)))
        self._most = MOST_ALONE if how.engine == "alone" else 1
        self._seats: dict[str, Seat] = {}
        self._refused: dict[str, str] = {}
        self._waiting: deque[Block] = deque()
        self._suspects: deque[Block] = deque()
        self._losses: dict[str, int] = {}
        self._ended: queue.SimpleQueue[tuple[Seat, str]] = queue.SimpleQueue()
        self._made: list[Finished] = []
        self._given = 0
        self._looked = -SECONDS_BETWEEN_LOOKS
        self._told_to_wait = False

    def has_room(self) -> bool:
        """Say whether another block should be given."""
        return len(self._waiting) + len(self._suspects) < self._most * max(1, self._free())

    def _free(self) -> int:
        """Count the bundles that workers could be given."""
        return sum(AHEAD * seat.threads - len(seat.bundles) for seat in self._seats.values())

    def give(self, block: Block) -> None:
        """Have a block run."""
        suspected = any(p.id in self._losses for p in block)
        (self._suspects if suspected else self._waiting).append(block)

    def is_busy(self) -> bool:
        """Say whether blocks were given that are not finished."""
        running = any(seat.bundles for seat in self._seats.values())
        return bool(running or self._waiting or self._suspects or self._made)

    def finished(self) -> list[Finished]:
        """Wait a while for blocks to be finished, and return them.

        Raises:
            CannotStore: if a trace cannot be written.
            DikbenchError: if the scheduler is lost, or every worker is refused.
        """
        self._look()
        self._place()
        with suppress(queue.Empty):
            seat, key = self._ended.get(timeout=SECONDS_BETWEEN_LOOKS)
            while True:
                self._take(seat, key)
                seat, key = self._ended.get_nowait()
        made, self._made = self._made, []
        return made

    def _look(self) -> None:
        """Find out which workers there are; what ran on one that is lost is suspected."""
        if time.monotonic() - self._looked < SECONDS_BETWEEN_LOOKS:
            return
        threads = self._ask()
        self._looked = time.monotonic()
        for address in [address for address in self._seats if address not in threads]:
            self._lose(self._seats.pop(address))
        for address, number in threads.items():
            if address not in self._seats and address not in self._refused:
                self._seats[address] = Seat(address, number)
        if self._seats:
            self._told_to_wait = False
        elif self._refused and not threads.keys() - self._refused:
            worker, reason = next(iter(self._refused.items()))
            raise DikbenchError(
                f"scheduler {self._address}: no worker can be used, such as {worker}: {reason}; "
                "valid: workers with the versions and files of this machine, started again"
            )
        elif not self._told_to_wait:
            self._told_to_wait = True
            print(f"scheduler {self._address}: waiting for workers", file=sys.stderr, flush=True)

    def _ask(self) -> Mapping[str, int]:
        """Return the number of threads of each worker by its address."""
        try:
            if self._client.status != "running":
                raise OSError("closed")
            found: dict[str, int] = self._client.sync(
                self._client.scheduler.ncores, callback_timeout=SECONDS_OF_CONNECTION
            )
        except (OSError, TimeoutError, AttributeError) as error:  # no scheduler any more
            raise DikbenchError(
                f"scheduler {self._address} is lost; rows that came back are kept, and the same "
                "command goes on from there"
            ) from error
        return found

    def _lose(self, seat: Seat) -> None:
        """Give what was on a lost worker to others; what ran is suspected of having ended it."""
        bundles = [*seat.bundles.values()]
        number = sum(len(block) for _, blocks in bundles for block in blocks)
        print(
            f"worker {seat.address} is lost; {number} {'trial' if number == 1 else 'trials'} "
            "that it was given run elsewhere",
            file=sys.stderr,
            flush=True,
        )
        for place, (future, blocks) in enumerate(bundles):
            future.cancel()
            if place < seat.threads:
                for block in blocks:
                    self._suspect(block, alone=seat.reserved)
            else:  # it had not begun
                self._waiting.extendleft(blocks)

    def _suspect(self, block: Block, *, alone: bool) -> None:
        """Have a block that was on a lost worker run alone, or end what was it again."""
        losses = 1 + max(self._losses.get(p.id, 0) for p in block)
        if losses < MOST_LOSSES or not alone:
            self._losses |= dict.fromkeys((p.id for p in block), losses)
            self._suspects.append(block)
        elif len(block) > 1:  # who it was is found out in smaller blocks, from the beginning
            self._losses |= dict.fromkeys((p.id for p in block), 0)
            self._made.append((block, None))
        else:
            reason = f"the trial ended {losses} workers of the cluster"
            row = row_without_run(block[0].trial, Status.CRASHED, reason)
            self._made.append((block, [row]))

    def _place(self) -> None:
        """Pin blocks to workers: suspects alone, the others where least is waiting."""
        seats = sorted(self._seats.values(), key=lambda seat: len(seat.bundles) / seat.threads)
        for seat in seats:
            if seat.reserved and not seat.bundles:
                seat.reserved = False
        for seat in seats:
            if sum(each.reserved for each in seats) < len(self._suspects):
                seat.reserved = True
            if seat.reserved and not seat.bundles and self._suspects:
                self._pin([self._suspects.popleft()], seat)
        open_seats = [seat for seat in seats if not seat.reserved]
        while self._waiting and open_seats:
            seat = min(open_seats, key=lambda seat: len(seat.bundles) / seat.threads)
            if len(seat.bundles) >= AHEAD * seat.threads:
                break
            size = min(self._most, max(1, len(self._waiting) // max(1, self._free())))
            self._pin([self._waiting.popleft() for _ in range(size)], seat)

    def _pin(self, blocks: list[Block], seat: Seat) -> None:
        self._given += 1
        key = f"dikbench-{self.run}-{self._given}"
        future = self._client.submit(
            self._run_blocks,
            self.run,
            blocks,
            self._how,
            self._expected,
            [sources_of(p.trial for p in block) for block in blocks],
            key=key,
            workers=[seat.address],
            priority=-self._given,  # a worker runs them in their order
            pure=False,
        )
        seat.bundles[key] = future, blocks
        future.add_done_callback(lambda _: self._ended.put((seat, key)))

    def _take(self, seat: Seat, key: str) -> None:
        """Take what came of blocks, unless their worker was lost."""
        if key not in seat.bundles or seat.address not in self._seats:
            return
        future, blocks = seat.bundles[key]
        if future.status not in ("finished", "error"):  # its worker or the scheduler is lost
            return
        try:
            answer = future.result(timeout=SECONDS_OF_CONNECTION)
        except (CannotStore, KeyboardInterrupt):
            raise
        except (TimeoutError, OSError):  # it was lost with its answer
            return
        except Exception as error:  # such as a dikbench without this module
            del seat.bundles[key]
            self._refuse(seat, blocks, f"{type(error).__name__}: {error}".partition("\n")[0])
            return
        del seat.bundles[key]
        if answer.refused:
            self._refuse(seat, blocks, answer.refused)
            return
        for block, made in zip(blocks, answer.made, strict=True):
            if made is None:  # there was no time for it
                self._waiting.appendleft(block)
                continue
            rows, traces = made
            for name, trace in traces.items():
                self._keep(name, trace)
            for p in block if rows is not None else ():
                self._losses.pop(p.id, None)
            self._made.append((block, rows))

    def _refuse(self, seat: Seat, blocks: Iterable[Block], reason: str) -> None:
        """Use a worker no more; what it was given goes to others."""
        if seat.address not in self._refused:
            self._refused[seat.address] = reason
            print(f"worker {seat.address} is refused: {reason}", file=sys.stderr, flush=True)
        for future, _ in seat.bundles.values():
            future.cancel()
        for block in [*blocks, *(block for _, others in seat.bundles.values() for block in others)]:
            self.give(block)
        self._seats.pop(seat.address, None)

    def _keep(self, trial: str, trace: bytes) -> None:
        path = self._folder.trace(trial)
        partial = path.with_name(f"{path.name}.partial")
        try:
            partial.write_bytes(trace)
            partial.replace(path)
        except OSError as error:
            partial.unlink(missing_ok=True)
            reason = error.strerror or str(error)
            raise CannotStore(f"trace {path} cannot be written: {reason}") from None


@contextmanager
def on_dask(address: str, folder: ResultsFolder, how: BlockSettings) -> Iterator[OnDask]:
    """Connect to a cluster; what runs there for us ends with this.

    Args:
        address: see `connected`.
        folder: where traces are kept.
        how: how blocks are run.

    Raises:
        DikbenchError: if dask.distributed is not installed, or there is no scheduler.
    """
    with connected(address) as client:
        from dikbench.run.dask_worker import release

        executor = OnDask(client, address, folder, how)
        try:
            yield executor
        finally:
            if client.status == "running":
                with suppress(Exception):  # of workers that are lost meanwhile
                    client.run(release, executor.run, on_error="ignore")
