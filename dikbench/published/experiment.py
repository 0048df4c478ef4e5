"""Published experiments as data: what was done, what was printed, and our formulation of each row.

Each is a TOML file in `experiments/`: a title, its source, a protocol with its settings, and rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import msgspec

from dikbench.errors import DikbenchError, unknown
from dikbench.published.agreement import Agreement
from dikbench.published.bargain import Bargain
from dikbench.published.circle import Circle
from dikbench.published.folder import FOLDER
from dikbench.published.gap import Gap
from dikbench.published.leaking import Leak
from dikbench.published.lecture import Matrix, Statements
from dikbench.published.measured import Measured, Statistic
from dikbench.published.outside import Outside
from dikbench.published.searches import Searches
from dikbench.published.small_angles import SmallAngles
from dikbench.published.stopping_early import StoppingEarly
from dikbench.published.twists import Twists

Protocol = (
    Searches
    | Twists
    | Circle
    | Agreement
    | Statements
    | Matrix
    | Bargain
    | Leak
    | StoppingEarly
    | Gap
    | SmallAngles
    | Outside
)


class Row(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A row of a published table.

    Attributes:
        name: what the source calls it.
        formulation: the selector of ours; empty where there is none.
        published: what was printed, by the names of the protocol's statistics; empty for a row of
            our own beside the table.
        settings: of the protocol, where they are not those of the experiment.
        rival: another formulation, the nearest without what the row is about: the verdict says
            whether the row distinguishes the two.
        fitted: whether settings were searched for until the numbers came out.
        not_covered: why the row cannot be measured here.
    """

    name: str
    formulation: str = ""
    published: Mapping[str, float] = {}
    settings: Mapping[str, Any] = {}
    rival: str = ""
    fitted: bool = False
    not_covered: str = ""


class Experiment(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A published experiment.

    Attributes:
        title: what it is, for `dikbench list published`.
        source: where it was published, with its version.
        protocol: what is done, and its settings.
        rows: of the published table.
        notes: what is known about it, a paragraph each.
        statements: whether what was published are statements, no numbers: the numbers of its rows
            are what the statements say.
    """

    title: str
    source: str
    protocol: Protocol
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()
    statements: bool = False

    @property
    def statistics(self) -> Mapping[str, Statistic]:
        """The columns of the table, by name."""
        return self.protocol.statistics

    def measure(self, row: Row) -> tuple[dict[str, Measured], dict[str, Measured] | None]:
        """Measure one row with our formulation, and with its rival if it has one."""
        settings = msgspec.structs.replace(self.protocol, **row.settings)
        measured = settings.measure(row.formulation)
        return measured, settings.measure(row.rival) if row.rival else None


def published_experiments() -> Mapping[str, Path]:
    """Return the files of the published experiments by name."""
    return MappingProxyType({path.stem: path for path in sorted(FOLDER.glob("*.toml"))})


@lru_cache
def load_experiment(name: str) -> Experiment:
    """Load a published experiment by name.

    Raises:
        DikbenchError: if there is none of this name, or its file makes no sense.
    """
    files = published_experiments()
    if name not in files:
        raise unknown("published experiment", name, files, every="dikbench list published")
    try:
        return msgspec.toml.decode(files[name].read_bytes(), type=Experiment)
    except msgspec.MsgspecError as error:
        raise DikbenchError(f"{files[name]}: {error}") from error
