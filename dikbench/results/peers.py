"""How formulations compare with peers, kept in the results folder as `peers.csv`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import pandas as pd

from dikbench.errors import DikbenchError

FILE: Final = "peers.csv"

KEYS: Final = ("formulation", "peer", "scenario", "solver")
"""Our formulation, the peer, the scenario, our solver: what a row is of."""

# ticks_stable: 1 where the times of both are stable, 0 where not, empty without times.
COLUMNS: Final = (
    *KEYS,
    "peer_version",
    "steps",
    "velocity_difference_max_rad_s",
    "explained_by",
    "our_tick_median_us",
    "peer_tick_median_us",
    "ticks_stable",
)

TEXTS: Final = (*KEYS, "peer_version", "explained_by")


def read_peers(folder: Path) -> pd.DataFrame:
    """Read the comparison of a results folder; without rows where nothing was compared.

    Raises:
        DikbenchError: if the file is damaged.
    """
    path = folder / FILE
    if not path.is_file():
        return pd.DataFrame(columns=list(COLUMNS))
    try:
        found = pd.read_csv(path, dtype=dict.fromkeys(TEXTS, str), keep_default_na=True)
        found[list(TEXTS)] = found[list(TEXTS)].fillna("")
        if "ticks_stable" not in found:  # written before it was known
            found["ticks_stable"] = float("nan")
        numbers = [name for name in COLUMNS if name not in TEXTS]
        found[numbers] = found[numbers].astype(float)
        return found[list(COLUMNS)]
    except (OSError, ValueError, KeyError):  # pandas' own errors are of values
        raise DikbenchError(
            f"{path}: not a comparison with peers; valid: without it, `dikbench time` makes it anew"
        ) from None


def write_peers(folder: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add rows to the comparison of a results folder, in place of those of the same keys.

    Raises:
        DikbenchError: if the folder cannot be written.
    """
    if not rows:
        return
    added = pd.DataFrame([{name: row.get(name) for name in COLUMNS} for row in rows])
    kept = read_peers(folder)
    together = added if kept.empty else pd.concat([kept, added.astype(kept.dtypes.to_dict())])
    together = together.drop_duplicates(list(KEYS), keep="last").sort_values(list(KEYS))
    path = folder / FILE
    partial = path.with_name(path.name + ".partial")
    try:
        together.to_csv(partial, index=False)
        partial.replace(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise DikbenchError(f"output folder {folder} cannot be written: {reason}") from None
