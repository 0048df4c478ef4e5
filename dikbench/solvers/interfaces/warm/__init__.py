"""The warm interface: a workspace per call site, updated in place and started from its last answer.

One file per back end, since each library says it in its own way.
"""

from dikbench.solvers.interfaces.warm.warm_solver import WarmSolver

__all__ = ["WarmSolver"]
