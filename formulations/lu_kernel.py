"""The kernel of a matrix as an LU decomposition with full pivoting gives it."""

from __future__ import annotations

import numpy as np

from dikbench.problem import Array


def lu_kernel(A: Array) -> Array:
    """Compute the kernel of A (m, n), columns (n, n - rank), as Eigen's FullPivLU does.

    Gaussian elimination with the largest remaining entry as pivot (the first in column order among
    equals) divides the columns into pivots and free ones; each basis vector has a one at its own
    free column and zeros at the others. A pivot below the largest one times the
    machine's precision times min(m, n) counts as zero.

    Source: Golub & Van Loan (2013), Matrix Computations, section 3.4; Eigen 3.4.
    """
    m, n = A.shape
    U = A.copy()
    columns = np.arange(n)
    rank, largest = 0, 0.0
    threshold = np.finfo(float).eps * min(m, n)
    for k in range(min(m, n)):
        corner = np.abs(U[k:, k:])
        where = int(np.argmax(corner.ravel(order="F")))
        column, row = divmod(where, m - k)
        pivot = corner[row, column]
        largest = max(largest, pivot)
        if pivot <= threshold * largest:
            break
        rank += 1
        if row:
            U[[k, k + row]] = U[[k + row, k]]
        if column:
            U[:, [k, k + column]] = U[:, [k + column, k]]
            columns[[k, k + column]] = columns[[k + column, k]]
        U[k + 1 :, k:] -= np.outer(U[k + 1 :, k] / U[k, k], U[k, k:])
    kernel = np.zeros((n, n - rank))
    if rank < n:
        kernel[columns[:rank]] = -np.linalg.solve(np.triu(U[:rank, :rank]), U[:rank, rank:])
        kernel[columns[rank:]] = np.eye(n - rank)
    return kernel
