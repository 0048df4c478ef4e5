"""What cvxpy says of its solvers does not reach the user."""

from __future__ import annotations

import subprocess
import sys

CODE = """
import numpy as np
from dikbench.errors import SolverFailed
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import make_solve

G, h = np.array([[1.0, 0.0, 1.0]]), np.array([1.5])
program = QuadraticProgram(np.diag([1.0, 2.0, 4.0]), np.array([-3.0, 2.0, 1.0]), G, h)
try:
    make_solve(parse_solver("scs[interface=cvxpy,max_iters=3]"), "qp")(program)
except SolverFailed:
    print("failed")
"""


def test_a_warning_beside_an_inaccurate_answer_is_silenced() -> None:
    """A step that fails is a row of results; a line on the terminal beside each would drown it."""
    command = [sys.executable, "-W", "always::UserWarning", "-c", CODE]
    found = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    assert found.stdout == "failed\n"
    assert "UserWarning" not in found.stderr
