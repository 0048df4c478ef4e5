"""The gate of `dikbench compare`: what a CI must not let pass, and what it must."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result

from dikbench.cli import commands

ANY = ("--tolerance", "position_error_rms_m=1e9")
"""A tolerance that no metric of the made-up rows exceeds."""

OUTCOMES: dict[str, Any] = {
    "outcome": "success",
    "robot": "panda",
    "feasible": "time",
    "situation": "free space",
    "judged_by_path": 1.0,
    "tolerance_m": 0.005,
    "speed_need": 0.5,
}


def dikbench(*arguments: object) -> Result:
    """`dikbench compare` with the arguments."""
    return CliRunner().invoke(commands, ["compare", *map(str, arguments)])


def first_line(result: Result) -> str:
    """What it says first."""
    return result.output.partition("\n")[0]


def test_a_trial_that_vanished_is_a_regression(folder: Callable[..., Path]) -> None:
    """A solver was renamed: half of A's trials are not in B, which every number would hide."""

    def rename(table: pd.DataFrame) -> None:
        table["solver"] = table["solver"].replace("daqp", "daqp[preset=high]")
        table["id"] += "x"

    a, b = folder("a"), folder("b", rename)
    result = dikbench(a, b, *ANY)
    assert (result.exit_code, first_line(result)) == (
        1,
        "REGRESSED: 6 trials of A missing in B.",
    )
    ungated = dikbench(a, b)
    assert (ungated.exit_code, first_line(ungated)) == (
        0,
        "B differs from A; without --tolerance nothing is judged.",
    )


def test_a_cell_that_was_skipped_in_a_may_be_missing(folder: Callable[..., Path]) -> None:
    """It could not run before either."""
    a = folder("a", lambda t: t.assign(status=["ok"] * 11 + ["skipped"]))
    b = folder("b", lambda t: t.head(11))
    assert dikbench(a, b, *ANY).exit_code == 0


@pytest.mark.parametrize(
    ("before", "after", "regressed"),
    [(0, 0.01, 1), (0.1, 0.4, 0), (0.1, 0.6, 1), (0.6, 0.01, 0), (np.nan, 1, 1), (1, np.nan, 0)],
)
def test_a_solver_that_newly_fails(
    folder: Callable[..., Path], before: float, after: float, regressed: int
) -> None:
    """In any step where it failed in none, or in most; the status of the trial stays ok."""

    def shares(value: float) -> Callable[[pd.DataFrame], Any]:
        return lambda table: table.assign(solver_failed_share=[value] + [0.0] * 11)

    a, b = folder("a", shares(before)), folder("b", shares(after))
    result = dikbench(a, b, *ANY)
    assert result.exit_code == regressed
    assert ("REGRESSED: the solver newly fails in 1 trial." == first_line(result)) == bool(
        regressed
    )
    assert ("## Solvers that newly fail" in result.output) == bool(regressed)
    if not np.isnan([before, after]).any():
        assert dikbench(a, b, "--tolerance", "solver_failed_share=1").exit_code == 0


def fails(*places: int) -> Callable[[pd.DataFrame], pd.DataFrame]:
    """Give rows outcomes, of which some are not success."""

    def change(table: pd.DataFrame) -> pd.DataFrame:
        table = table.assign(**OUTCOMES)
        table.loc[list(places), "outcome"] = "left-path"
        return table

    return change


def test_success_must_not_fall(folder: Callable[..., Path]) -> None:
    """A seed of one of two scenarios of one of two families is worth 1/8 of a formulation."""
    a, b = folder("a", fails()), folder("b", fails(2))
    result = dikbench(a, b, *ANY)
    assert result.exit_code == 1
    assert first_line(result) == (
        "REGRESSED: success of dls (ideal plant, time) fell from 100.0 to 87.5 %."
    )
    assert "| dls " in result.output.partition("## Success")[2]
    assert dikbench(b, a, *ANY).exit_code == 0
    assert dikbench(a, b, "--tolerance", "success=12%").exit_code == 1
    for allowed in ("success=13%", "success=0.13", "success=12.5%"):
        assert dikbench(a, b, "--tolerance", allowed).exit_code == 0
    assert dikbench(a, b).exit_code == 0


def test_what_got_worst_is_told_first(folder: Callable[..., Path]) -> None:
    """The larger fall and the larger ratio, though its formulation comes later in the rows."""

    def slow(table: pd.DataFrame) -> None:
        factor = table["formulation"].map({"dls": 2.0, "qp": 3.0}).fillna(1.0)
        table["formulation_time_median_us"] *= factor

    def change(table: pd.DataFrame) -> pd.DataFrame:
        dls, qp = (table.index[table["formulation"].eq(name)] for name in ("dls", "qp"))
        assert dls[0] < qp[0]
        slow(table := fails(dls[0], *qp[:2])(table))
        return table

    a, b = folder("a", fails()), folder("b", change)
    line = first_line(dikbench(a, b, "--tolerance", "formulation_time_median_us=20%", *ANY))
    assert line.index("success of qp") < line.index("success of dls")
    assert line.index("qp with daqp takes 3 times") < line.index("dls takes 2 times")


def test_success_that_one_folder_does_not_know(folder: Callable[..., Path]) -> None:
    """Older results have no outcomes: other gates hold, and one on success is refused."""
    a, b = folder("a", lambda table: table.drop(columns="outcome")), folder("b", fails(2))
    assert dikbench(a, b, *ANY).exit_code == 0
    result = dikbench(a, b, "--tolerance", "success=0")
    assert (result.exit_code, result.output.count("\n")) == (2, 1)
    assert "no outcomes" in result.output


def test_times_are_gated_as_ratios(folder: Callable[..., Path]) -> None:
    """30 % longer is beyond 20 % and within 40 %; microseconds are refused."""

    def slow(table: pd.DataFrame) -> None:
        qp = table["formulation"].eq("qp")
        table.loc[qp, "formulation_time_median_us"] *= 1.3
        table.loc[qp, "formulation_time_p99_us"] *= 3

    a, b = folder("a"), folder("b", slow)
    result = dikbench(a, b, "--tolerance", "formulation_time_median_us=20%")
    assert result.exit_code == 1
    assert first_line(result) == (
        "REGRESSED: qp with daqp takes 1.3 times as long (formulation_time_median_us)."
    )
    assert dikbench(a, b, "--tolerance", "formulation_time_median_us=40%").exit_code == 0
    assert dikbench(b, a, "--tolerance", "formulation_time_median_us=0%").exit_code == 0
    assert dikbench(a, b, "--tolerance", "formulation_time_p99_us=100%").exit_code == 1
    assert dikbench(a, b, *ANY).exit_code == 0
    refused = dikbench(a, b, "--tolerance", "formulation_time_median_us=5")
    assert (refused.exit_code, refused.output.count("\n")) == (2, 1)
    assert "formulation_time_median_us=20%" in refused.output


def test_times_that_vanished(folder: Callable[..., Path]) -> None:
    """A gate on times does not pass where B has none; without any at all it is refused."""
    nothing = {"formulation_time_median_us": np.nan, "formulation_time_p99_us": np.nan}
    gate = ("--tolerance", "formulation_time_median_us=20%")

    def forget(table: pd.DataFrame) -> None:
        table.loc[table["scenario"].eq("reach"), list(nothing)] = np.nan

    result = dikbench(folder("a"), folder("b", forget), *gate)
    assert first_line(result) == "REGRESSED: 2 timed cells of A without times in B."
    bare = folder("bare", lambda table: table.assign(**nothing))
    assert dikbench(folder("a"), bare, *gate).exit_code == 2


def test_rounding_is_no_difference(folder: Callable[..., Path]) -> None:
    """The last bits differ between machines: 1e-9 of a value is the same, 1e-8 is not."""

    def scaled(by: float) -> Path:
        return folder(f"{by}", lambda table: table.assign(sigma_min=table["sigma_min"] * (1 + by)))

    a = folder("a", lambda table: table.assign(gap_max=0.0))
    noise = folder("noise", lambda table: table.assign(gap_max=1e-17, sigma_min=0.5 * (1 - 9e-10)))
    result = dikbench(a, noise, "--tolerance", "sigma_min=0", "--tolerance", "gap_max=0")
    assert (result.exit_code, first_line(result)) == (0, "Within tolerance: no difference.")
    assert first_line(dikbench(scaled(0.0), scaled(-9e-10))) == "No difference."
    assert dikbench(scaled(0.0), scaled(-1e-8), "--tolerance", "sigma_min=0").exit_code == 1


def test_what_is_no_longer_defined_hides_no_worse_number(folder: Callable[..., Path]) -> None:
    """A solver that never answers leaves its own metrics undefined: that is told last."""

    def answers(failed: float, verified: float) -> Callable[[pd.DataFrame], pd.DataFrame]:
        return lambda table: table.assign(solver_failed_share=failed, verified_share=verified)

    result = dikbench(folder("a", answers(0.0, 1.0)), folder("b", answers(1.0, np.nan)))
    lines = [line for line in result.output.splitlines() if line.startswith("| ")]
    names = [line.split("|")[1].strip() for line in lines]
    assert names.index("solver_failed_share") < names.index("verified_share")
    assert "nan" not in result.output


def test_the_first_line_tells_a_few_and_counts_the_rest(folder: Callable[..., Path]) -> None:
    """Five formulations fall in the setting that they have: three are named."""

    def named(*fallen: int) -> Callable[[pd.DataFrame], pd.DataFrame]:
        def change(table: pd.DataFrame) -> pd.DataFrame:
            five = [
                table.head(1).assign(formulation=f"law{number}", id=str(number), **OUTCOMES)
                for number in range(5)
            ]
            return pd.concat(five, ignore_index=True).assign(
                outcome=["left-path" if number in fallen else "success" for number in range(5)]
            )

        return change

    line = first_line(dikbench(folder("a", named()), folder("b", named(*range(5))), *ANY))
    assert line.count("success of") == 3
    assert line.endswith("; 2 more like it.")
