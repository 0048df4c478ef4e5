"""The answer of a back end, not yet rechecked."""

from __future__ import annotations

import msgspec

from dikbench.arrays import Array


class Answer(msgspec.Struct, eq=False):
    """A solver's answer to one program.

    Attributes:
        x: the solution, (n,), or None.
        claimed: whether the solver says that it solved the program.
        y, z, z_box: multipliers of the equalities, the inequalities and the bounds (negative for a
            lower bound), or None where the interface does not give them.
        core_ns: time inside the solver library, without its Python wrapper [ns].
    """

    x: Array | None
    claimed: bool
    y: Array | None = None
    z: Array | None = None
    z_box: Array | None = None
    core_ns: int = 0
