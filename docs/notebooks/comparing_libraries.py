# %% [markdown]
# # Comparing libraries
#
# Libraries ask for the same step in other words. Here one step of a Panda in those of Pink and
# mink, in those of Drake, and in ours, with what must be changed to compare them.

# %%
import numpy as np

import dikbench

robot = dikbench.load_robot("panda")
twist = np.array([0.2, 0.0, -0.1, 0.0, 0.3, 0.0])


def ask(formulation):
    """Ask a formulation for one step of 10 ms; a library that is not there says so."""
    try:
        return dikbench.solve_dik(robot, robot.q0, twist=twist, dt=0.01, formulation=formulation)
    except dikbench.DikbenchError as error:
        print(f"{formulation}: {str(error)[:90]}")
        return None


# %% [markdown]
# Far from limits and singularities all are the least-squares velocity, but for damping: the largest
# difference from the pseudo-inverse in rad/s.

# %%
exact = ask("pinv").velocity
for formulation in ("qp", "pink-qp", "mink-qp", "drake", "lp-alpha"):
    answer = ask(formulation)
    difference = np.abs(answer.velocity - exact).max()
    print(f"{formulation:9} progress {answer.progress:.5f}, difference {difference:.1e}")

# %% [markdown]
# Words that mean different things:
#
# - a **gain**: here in 1/s. A library that closes a share g of the error per step has g = K dt;
# - a **cost** c of Pink and mink stands inside the norm: it is the weight c^2 here;
# - a **damping** lambda here is lambda^2 in front of |v|^2; a Tikhonov damping is that square.
#
# The real libraries, where they are installed (`pip install "dikbench[peers,drake]"`):

# %%
for formulation in ("peer-pink", "peer-mink", "peer-drake"):
    answer = ask(formulation)
    if answer is not None:
        difference = np.abs(answer.velocity - exact).max()
        print(f"{formulation:10} progress {answer.progress:.5f}, difference {difference:.1e}")

# %% [markdown]
# The program is one thing, the solver another. The same `qp` by four of them:

# %%
reference = dikbench.solve_dik(robot, robot.q0, twist=20 * twist, formulation="qp").velocity
for solver in ("daqp", "clarabel", "osqp", "osqp[preset=high]"):
    answer = dikbench.solve_dik(robot, robot.q0, twist=20 * twist, formulation="qp", solver=solver)
    print(f"{solver:18} {np.abs(answer.velocity - reference).max():.1e} rad/s from daqp's answer")
