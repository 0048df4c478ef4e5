# %% [markdown]
# # A law of your own
#
# A law is a frozen dataclass with a method `velocity(problem, solve)`. Here damped least squares,
# whose damping grows with the task's error.

# %%
from pathlib import Path

import dikbench
from dikbench.testing import check_formulation

Path("error_damped.py").write_text(
    '''
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from dikbench.problem import Parameters, Range


@dataclass(frozen=True)
class ErrorDamped(Parameters):
    """Damped least squares, the more damped the larger the task velocity.

    Attributes:
        share: damping per task velocity.
    """

    share: Annotated[float, Range(0.0)] = 0.1

    def velocity(self, problem, solve):
        J, V = problem.primary.J, problem.primary.V
        damping = self.share * np.linalg.norm(V) + 1e-6
        return J.T @ np.linalg.solve(J @ J.T + damping**2 * np.eye(len(V)), V)
''',
    encoding="utf-8",
)
LAW = "error_damped.py:ErrorDamped"

# %% [markdown]
# One step at a prompt, where `print` and a debugger work:

# %%
robot = dikbench.load_robot("panda")
answer = dikbench.solve_dik(robot, robot.q0, twist=[0.1, 0, 0, 0, 0, 0], formulation=LAW)
print(answer.velocity.round(3), answer.status)

# %% [markdown]
# With a share of 0 it is the pseudo-inverse:

# %%
exact = dikbench.solve_dik(robot, robot.q0, twist=[0.1, 0, 0, 0, 0, 0], formulation="pinv")
undamped = dikbench.solve_dik(
    robot, robot.q0, twist=[0.1, 0, 0, 0, 0, 0], formulation=f"{LAW}[share=0]"
)
assert abs(exact.velocity - undamped.velocity).max() < 1e-6

# %% [markdown]
# In closed loop, beside a law that comes with dikbench. The study's file leaves out the section
# `[timing]`, so that no times are taken.

# %%
Path("untimed.toml").write_text(
    'description = "mine"\nscenarios = ["reach"]\nplants = ["ideal"]\n'
    '[[cells]]\nformulations = ["dls"]\n',
    encoding="utf-8",
)
results = dikbench.run_study(
    "untimed.toml",
    formulations=[f"{LAW}[share=0.01|0.3]", "dls"],
    scenarios="near-miss[miss=0.05]",
    references="path",
    out="runs/own_law",
    jobs=1,
    report=False,
)
columns = ["formulation", "outcome", "velocity_peak_ratio", "slow_down"]
print(results.trials[columns].round(3).to_string(index=False))

# %% [markdown]
# `dikbench check error_damped.py:ErrorDamped` says which promises it keeps, a line each; in
# your own tests it is a function, which raises where one is broken. It takes a minute.

# %%
print(check_formulation.__doc__.splitlines()[0])
