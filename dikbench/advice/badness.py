"""How bad a trial was: first by its outcome, then by its distance from the path."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, log
from typing import Any, Final, NamedTuple

from dikbench.simulation.status import Status
from dikbench.statistics.first_places import BROKEN
from dikbench.statistics.success import DONE

DONE_RANK: Final = 0
FAILED_RANK: Final = 1
BROKEN_RANK: Final = 2
"""A job that is not done is worse than any distance, and a broken limit, a collision or a run that
broke off worse than that."""

NEAREST_M: Final = 1e-6
FARTHEST_M: Final = 1e6
"""Distances are told apart between these."""

NOT_REPRODUCIBLE: Final = frozenset({Status.TIMEOUT.value, Status.OUT_OF_MEMORY.value})
"""Ends of a run that depend on the machine and what else it does."""


class Badness(NamedTuple):
    """How bad a trial was; of two, the greater one is worse.

    Attributes:
        rank: `DONE_RANK`, `FAILED_RANK` or `BROKEN_RANK`.
        distance: largest distance from the path [m]; of a target at rest that the robot has yet
            to reach, the distance at the end. Infinite where the motion has none.
    """

    rank: int
    distance: float

    @property
    def number(self) -> float:
        """A number that is greater where the trial is worse, `rank` to `rank` + 1.

        Within a rank it is the share of ln(distance) between its bounds.
        """
        distance = min(max(self.distance, NEAREST_M), FARTHEST_M)
        return self.rank + log(distance / NEAREST_M) / log(FARTHEST_M / NEAREST_M)


def badness_of(row: Mapping[str, Any]) -> Badness | None:
    """Say how bad the trial of a row was; None where it does not count.

    A trial counts if it ran, if what became of it does not depend on the machine, and if a motion
    is known that does what the scenario asks for: of others nobody knows whether anything can be
    done. Of a run without a step this is not known, and it counts.
    """
    status, outcome = row["status"], row.get("outcome")
    if status == Status.SKIPPED.value or status in NOT_REPRODUCIBLE or not outcome:
        return None
    if row.get("feasible", "path") not in ("time", "path"):
        return None
    rank = DONE_RANK if outcome in DONE else BROKEN_RANK if outcome in BROKEN else FAILED_RANK
    stays = bool(row.get("judged_by_path")) or row.get("holds") == 1
    column = "contour_error_6d_max_m" if stays else "tracking_error_6d_final_m"
    distance = row.get(column)
    return Badness(rank, inf if distance is None or distance != distance else float(distance))


def worse_by(first: Badness, second: Badness) -> float:
    """Compare two trials of one case: positive where the first is worse.

    A difference of ranks counts for more than any of distances; these count by their ratio.
    """
    ranks = first.rank - second.rank
    return 2 * ranks + (first.number - first.rank) - (second.number - second.rank)
