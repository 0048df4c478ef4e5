# %% [markdown]
# # Reading results with pandas
#
# A results folder is a table with a row per trial; committed ones will do. From a checkout:

# %%
import dikbench

results = dikbench.load_results("results/quick")
trials = results.trials
print(len(trials), "trials,", trials["formulation"].nunique(), "formulations")

# %% [markdown]
# How they ended, where the path waits:

# %%
waits = trials[(trials["reference"] == "path") & (trials["solver"].isin(["none", "daqp"]))]
print(waits.groupby(["formulation", "outcome"]).size().unstack(fill_value=0).to_string())

# %% [markdown]
# What a selector says is in columns of its own. The peak of the joint speed over its limit, by
# the distance at which a UR5's singularity is missed:

# %%
misses = waits.query("scenario_family == 'near-miss' and scenario_robot == 'ur5'")
print(
    misses.pivot_table("velocity_peak_ratio", "formulation", "scenario_miss").round(2).to_string()
)

# %% [markdown]
# What a column is in, and what it is:

# %%
for name in ("velocity_peak_ratio", "contour_error_6d_max_m"):
    print(f"{name} [{trials.attrs['units'].get(name, '')}]: {trials.attrs['definitions'][name]}")

# %% [markdown]
# Two formulations over the cases that both ran, pair by pair: never compare two averages over
# different cases.

# %%
distance = waits.pivot_table("contour_error_6d_max_m", ["scenario", "seed"], "formulation")
pair = distance[["dls", "lp-alpha"]].dropna()
print(
    f"lp-alpha is nearer to its path than dls in {(pair['lp-alpha'] < pair['dls']).sum()}", end=""
)
print(f" of {len(pair)} cases")

# %% [markdown]
# `dikbench compare results/quick --formulation dls --formulation 'lp-alpha with daqp'` does it with
# intervals, over families, robots, scenarios and seeds.
