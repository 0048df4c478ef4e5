# %% [markdown]
# # A near miss by hand
#
# Why do laws differ near a singularity? One step of a UR5 whose wrist is 0.02 rad from its
# singularity (q5 = 0), and the Jacobian at hand.

# %%
import numpy as np
import pinocchio as pin

import dikbench

robot = dikbench.load_robot("ur5")
q = np.array([0.3, -1.2, 1.4, -1.0, 0.02, 0.2])

data = robot.model.createData()
J = pin.computeFrameJacobian(robot.model, data, q, robot.frame_id, pin.LOCAL)
U, sigma, Vt = np.linalg.svd(J)
print("singular values (m, rad):", sigma.round(4))

# %% [markdown]
# The smallest one is nearly 0: along `U[:, 5]`, the lost direction, the hand moves by 0.008 when
# the joints move by 1. A pseudo-inverse divides by it. Ask for 0.1 along that direction:

# %%
twist = 0.1 * U[:, 5]
needed = np.linalg.pinv(J) @ twist
print("joint speeds that it takes [rad/s]:", needed.round(2))
print("their limits [rad/s]:", robot.limits.velocity.upper)

# %% [markdown]
# Four laws, one step each. `progress` is the share of the twist that is done; the error is what
# else is done.


# %%
def step(formulation, twist):
    """Ask a formulation for one step of 5 ms, and say what comes of it."""
    answer = dikbench.solve_dik(robot, q, twist=twist, dt=0.005, formulation=formulation)
    speed = np.abs(answer.velocity / robot.limits.velocity.upper).max()
    across = J @ answer.velocity - answer.progress * twist
    print(
        f"{formulation:10} speed/limit {speed:5.2f}, progress {answer.progress:5.3f}, "
        f"across {np.linalg.norm(across):.4f}"
    )
    return answer


for formulation in ("pinv", "dls", "qp", "lp-alpha"):
    step(formulation, twist)

# %% [markdown]
# The pseudo-inverse does all of it beyond the limit. The others do less of it: damping because of
# its price on speed, the two programs because of the limits. They part when the twist has a share
# that can be done and one that cannot:

# %%
mixed = twist + 0.2 * U[:, 0]
for formulation in ("pinv", "dls", "qp", "lp-alpha"):
    step(formulation, mixed)

# %% [markdown]
# `dls` and `qp` do what is cheap and leave out the rest, so that the hand goes elsewhere: `across`
# is large. `lp-alpha` slows all of it down and stays in the direction. That is what decides who
# stays on the path, and who is on time.

# %%
answer = dikbench.solve_dik(robot, q, twist=mixed, dt=0.005, formulation="lp-alpha")
assert np.allclose(J @ answer.velocity, answer.progress * mixed, atol=1e-6)
