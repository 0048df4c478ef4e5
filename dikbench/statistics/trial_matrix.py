"""A metric as a matrix: cases x formulations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Indices

CASE = ["scenario", "plant", "reference", "seed"]
CONTENDER = ["formulation", "solver"]


@dataclass(frozen=True, eq=False)
class TrialMatrix:
    """The place of each trial in matrices of cases x formulations.

    Attributes:
        cases: a row per case: scenario and, if there, plant, reference and seed.
        contenders: a row per formulation and solver.
        row: row of each trial, (n,).
        column: column of each trial, (n,).
    """

    cases: pd.DataFrame
    contenders: pd.DataFrame
    row: Indices
    column: Indices

    @classmethod
    def of(cls, trials: pd.DataFrame) -> TrialMatrix:
        """Lay out trials, of which a formulation has one per case, in order of appearance."""
        row, cases = _numbered(trials, [name for name in CASE if name in trials])
        column, contenders = _numbered(trials, CONTENDER)
        return cls(cases, contenders, row, column)

    def fill(self, values: Array, missing: float = np.nan) -> Array:
        """Return the matrix (cases, formulations) of one value per trial."""
        matrix = np.full((len(self.cases), len(self.contenders)), missing)
        matrix[self.row, self.column] = values
        return matrix


def _numbered(trials: pd.DataFrame, keys: list[str]) -> tuple[Indices, pd.DataFrame]:
    """Number the distinct combinations of keys; return each row's number, and them."""
    number = trials.groupby(keys, sort=False, dropna=False).ngroup()
    return np.asarray(number, dtype=np.intp), trials[keys].drop_duplicates(ignore_index=True)
