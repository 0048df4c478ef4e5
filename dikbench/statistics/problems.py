"""A metric as a matrix: problems x laws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Indices

PROBLEM = ["scenario", "plant", "reference", "seed"]
LAW = ["formulation", "solver"]


@dataclass(frozen=True, eq=False)
class ProblemMatrix:
    """Where each trial stands in matrices of problems x laws.

    Attributes:
        problems: a row per problem: scenario and those of plant, reference and seed there are.
        laws: a row per law: formulation and solver.
        row: of each trial, (n,).
        column: of each trial, (n,).
    """

    problems: pd.DataFrame
    laws: pd.DataFrame
    row: Indices
    column: Indices

    @classmethod
    def of(cls, trials: pd.DataFrame) -> ProblemMatrix:
        """Lay out trials, of which a law has one per problem, in the order of their appearance."""
        row, problems = _numbered(trials, [name for name in PROBLEM if name in trials])
        column, laws = _numbered(trials, LAW)
        return cls(problems, laws, row, column)

    def fill(self, values: Array, missing: float = np.nan) -> Array:
        """The matrix (problems, laws) of one value per trial."""
        matrix = np.full((len(self.problems), len(self.laws)), missing)
        matrix[self.row, self.column] = values
        return matrix


def _numbered(trials: pd.DataFrame, keys: list[str]) -> tuple[Indices, pd.DataFrame]:
    """The number of each row's combination of keys, and the combinations."""
    number = trials.groupby(keys, sort=False, dropna=False).ngroup()
    return np.asarray(number, dtype=np.intp), trials[keys].drop_duplicates(ignore_index=True)
