"""Performance profiles: how often a formulation is within a factor of the best.

Of problem p and formulation s with cost t_ps, the ratio is r_ps = t_ps / min_s t_ps and the profile
rho_s(tau) the share of the problems with r_ps <= tau: rho_s(1) is how often s is the best, the
limit for large tau how often it solves a problem at all.

The best is taken over the formulations at hand, so that the order of two formulations can flip when
a third is taken out (Gould & Scott 2016): profiles of all formulations rank the first one only.
Profiles of pairs of formulations are given in addition.

Source: Dolan & Moré 2002, Benchmarking optimization software with performance profiles; Gould &
Scott 2016, A note on performance profiles for benchmarking software.
"""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array


def performance_ratios(costs: Array) -> Array:
    """Compute r_ps, (problems, formulations), infinite where a problem was not solved.

    Problems that no formulation solved keep infinite ratios, so that every profile ends below 1.

    Args:
        costs: t_ps > 0 (raise to a floor below which costs count as equal); infinite or NaN where
            a problem was not solved.
    """
    solved = np.where(np.isnan(costs), np.inf, costs)
    best = solved.min(axis=1, keepdims=True, initial=np.inf)
    ratios = np.full(costs.shape, np.inf)
    np.divide(solved, best, out=ratios, where=np.isfinite(solved))
    return ratios


def profile(ratios: Array, factors: Array) -> Array:
    """Compute rho_s at each factor tau, (factors, formulations); NaN where there are no problems.

    Args:
        ratios: (problems, formulations), of `performance_ratios`.
        factors: taus >= 1, ascending.
    """
    if not len(ratios):
        return np.full((len(factors), ratios.shape[1]), np.nan)
    ordered = np.sort(ratios, axis=0)
    counts = [np.searchsorted(column, factors, side="right") for column in ordered.T]
    return np.array(counts, dtype=float).reshape(ratios.shape[1], -1).T / len(ratios)


def area(ratios: Array, largest: float) -> Array:
    """Compute each profile's mean height over 1 <= tau <= largest, log axis, (formulations,).

    Args:
        ratios: (problems, formulations), of `performance_ratios`; at least one problem.
        largest: tau at which the axis ends, above 1.
    """
    heights: Array = np.mean(1 - np.log(np.minimum(ratios, largest)) / np.log(largest), axis=0)
    return heights
