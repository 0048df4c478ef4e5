"""The warm interface: a workspace per call site, updated in place and started from its last answer.

There is one file per back end, since the libraries' interfaces differ.
"""

from dikbench.solvers.interfaces.warm.warm_solver import WarmSolver

__all__ = ["WarmSolver"]
