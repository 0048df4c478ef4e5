# %% [markdown]
# # An arm of your own
#
# Any URDF is a robot. Here one is written out, so that the notebook needs no other file.

# %%
from pathlib import Path

import dikbench


def joint(number, parent, child, axis, z):
    """Write a joint of the arm."""
    return f"""
  <link name="{child}"/>
  <joint name="j{number}" type="revolute">
    <parent link="{parent}"/><child link="{child}"/>
    <origin xyz="0 0 {z}"/><axis xyz="{axis}"/>
    <limit lower="-2.8" upper="2.8" velocity="2.5" effort="80"/>
  </joint>"""


AXES = ("0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1")
LENGTHS = (0.2, 0.1, 0.35, 0.15, 0.25, 0.1)
names = ["base", *(f"link{number}" for number in range(1, 7))]
joints = [
    joint(number + 1, names[number], names[number + 1], AXES[number], LENGTHS[number])
    for number in range(6)
]
tool = """
  <link name="tool"/>
  <joint name="mount" type="fixed">
    <parent link="link6"/><child link="tool"/><origin xyz="0 0 0.1"/>
  </joint>"""
Path("my_arm.urdf").write_text(
    f'<robot name="my_arm">\n  <link name="base"/>{"".join(joints)}{tool}\n</robot>\n',
    encoding="utf-8",
)

# %% [markdown]
# `dikbench show my_arm.urdf` prints joints, limits and frames; from Python:

# %%
robot = dikbench.load_robot("my_arm.urdf", frame="tool")
print(robot.nv, "joints, speeds", robot.limits.velocity.upper)
print("start, inside its limits and away from singularities:", robot.q0.round(2))

# %% [markdown]
# A near miss of its own: its singular postures are found, and the certificate measured. It runs as
# on a robot of the catalogue.

# %%
Path("untimed.toml").write_text(
    'description = "mine"\nscenarios = ["reach"]\nplants = ["ideal"]\n'
    '[[cells]]\nformulations = ["dls"]\n',
    encoding="utf-8",
)
results = dikbench.run_study(
    "untimed.toml",
    formulations=["pinv", "pinv[after=scale]", "dls"],
    scenarios=[
        "near-miss[robot=my_arm.urdf,frame=tool]",
        "speed-sweep[robot=my_arm.urdf,frame=tool]",
    ],
    references="path",
    out="runs/own_arm",
    jobs=1,
    report=False,
)
table = results.trials.pivot_table(
    "outcome", "formulation", "scenario_family", aggfunc=lambda outcomes: ", ".join(outcomes)
)
print(table.to_string())

# %% [markdown]
# What was asked of the joints, over their limits, by the motion that follows the path exactly:

# %%
print(results.trials.groupby("scenario_family")["speed_need"].first().round(2).to_string())
