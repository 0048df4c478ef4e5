"""What must hold of every study whatever it finds; otherwise the benchmark is wrong.

Straw laws (`dikbench.testing.straw`) may win nothing, and what a known joint motion does must count
as done. `check_benchmark` runs a study together with them and looks for broken invariants.
"""

from __future__ import annotations

from dikbench.invariants.benchmark import check_benchmark, with_straw_laws
from dikbench.invariants.of_rows import INVARIANTS, Invariant

__all__ = ["INVARIANTS", "Invariant", "check_benchmark", "with_straw_laws"]
