"""What stands in `results/seeds.md`: commands that exist, and figures of the committed tables."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import pytest

from dikbench.published.experiment import published_experiments

CHECKOUT = Path(__file__).parents[3]
RESULTS = CHECKOUT / "results"
pytestmark = pytest.mark.skipif(not RESULTS.is_dir(), reason="the results are no part of the sdist")


def claims() -> list[list[str]]:
    """The cells of each row: number, claim, verdict, figure, command."""
    lines = (RESULTS / "seeds.md").read_text(encoding="utf-8").splitlines()
    rows = [line.strip("| ").split(" | ") for line in lines if re.match(r"\| \d+ \|", line)]
    return rows if all(len(row) == 5 for row in rows) else []


def test_every_claim_has_a_verdict_a_figure_and_a_command_that_exists() -> None:
    """They are numbered; experiments, formulations, folders and test modules are there."""
    rows = claims()
    assert [int(row[0]) for row in rows] == list(range(1, 21))
    trials = pd.read_parquet(RESULTS / "full" / "trials.parquet", columns=["formulation"])
    ran = set(trials["formulation"])
    for _, _, verdict, figure, command in rows:
        assert verdict.startswith("**")
        assert figure
        program, first, *others = command.strip("`").split()
        if program == "pytest":
            assert (CHECKOUT / first).exists()
        elif first == "reproduce":
            assert others[0] in published_experiments()
        else:
            assert others[0] == "results/full"
            for given in re.findall(r'--formulations? "([^"]+)"', command):
                names = {name.removesuffix(" with daqp") for name in given.split(",")}
                assert names <= ran


@pytest.mark.parametrize(
    ("number", "reference", "column", "laws"),
    [
        (4, "path", "near_singularities_percent", ("qp", "drake", "lp-alpha")),
        (4, "path", "beyond_joint_speed_percent", ("qp", "drake", "lp-alpha")),
        (6, "path", "free_space_percent", ("nullspace-unprojected", "nullspace")),
        (10, "path", "at_joint_limits_percent", ("joint-centering", "pinv", "lp-alpha")),
        (12, "path", "near_singularities_percent", ("lp-alpha", "pinv[after=clip]")),
        (15, "path", "near_singularities_percent",
         ("dls[damping=0.01]", "dls[damping=0.05]", "dls[damping=0.3]")),
        (15, "path", "free_space_percent", ("dls[damping=0.3]", "pinv")),
    ],
)  # fmt: skip
def test_rates_are_those_of_the_committed_table(
    number: int, reference: str, column: str, laws: tuple[str, ...]
) -> None:
    """As whole percents."""
    table = pd.read_csv(RESULTS / "full" / "tables" / "success.csv")
    table = table[table["reference"].eq(reference) & table["solver"].isin(["none", "daqp"])]
    figure = claims()[number - 1][3]
    for law in laws:
        (rate,) = table.loc[table["formulation"].eq(law), column].astype(float)
        assert re.search(rf"(?<![\d.]){rate:.0f}(?![\d.]\d)", figure), (law, rate)
