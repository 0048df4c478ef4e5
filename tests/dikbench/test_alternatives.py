"""Lists of values in selectors, where a study or the command line selects."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.errors import DikbenchError
from dikbench.selector import alternatives
from dikbench.study.selection import Selection, select
from dikbench.study.study import load_study

STUDY = """
description = "sweeps"
scenarios = ["near-miss[robot=ur5|ur10,miss=0.05|0.02]", "reach"]
plants = ["ideal[noise=0|1e-4]"]
seeds = [0, 1]

[[cells]]
formulations = ["dls[damping=0.01|0.1]", "pinv"]

[[cells]]
formulations = ["qp"]
solvers = ["osqp[eps_abs=1e-4|1e-6]"]
"""


def texts(selector: str) -> list[str]:
    """Every selector that a text with lists stands for, as texts."""
    return [str(one) for one in alternatives(selector)]


def test_lists_become_a_product_in_order() -> None:
    """The last one runs fastest; what is no list stays as it is."""
    assert texts("dls[damping=0.01|0.1]") == ["dls[damping=0.01]", "dls[damping=0.1]"]
    assert texts("a[x=1|2,y=3,z=u|v]") == [
        "a[x=1,y=3,z=u]",
        "a[x=1,y=3,z=v]",
        "a[x=2,y=3,z=u]",
        "a[x=2,y=3,z=v]",
    ]
    assert texts("pinv[after=clip]") == ["pinv[after=clip]"]
    assert texts("a.py:B[x=1 | 2]") == ["a.py:B[x=1]", "a.py:B[x=2]"]


values = st.text("abc0123.-", min_size=1, max_size=4)


options_of_one = st.lists(values, min_size=1, max_size=3, unique=True)


@given(lists=st.lists(options_of_one, min_size=1, max_size=3))
def test_the_product_is_complete_and_each_selector_has_one_value(lists: list[list[str]]) -> None:
    """As many as the lists' lengths make, all different, each parses to one value per list."""
    inside = ",".join(f"p{n}={'|'.join(options)}" for n, options in enumerate(lists))
    found = alternatives(f"law[{inside}]")
    size = 1
    for options in lists:
        size *= len(options)
    assert len({tuple(s.parameters.values()) for s in found}) == len(found) == size
    for selector in found:
        assert all(
            value in options
            for value, options in zip(selector.parameters.values(), lists, strict=True)
        )


@pytest.mark.parametrize("text", ["a[x=1||2]", "a[x=|1]", "a[x=1|1]"])
def test_an_empty_value_or_one_given_twice_is_an_error(text: str) -> None:
    """One line that names the parameter."""
    with pytest.raises(DikbenchError, match="x lists an empty value, or one twice"):
        alternatives(text)


def test_a_study_spreads_every_axis(tmp_path: Path) -> None:
    """Formulations, solvers, scenarios and plants."""
    file = tmp_path / "sweeps.toml"
    file.write_text(STUDY)
    study = load_study(str(file))
    assert len(study.scenarios) == 5
    assert study.scenarios[0] == "near-miss[robot=ur5,miss=0.05]"
    assert study.plants == ("ideal[noise=0]", "ideal[noise=1e-4]")
    assert study.cells[0].formulations == ("dls[damping=0.01]", "dls[damping=0.1]", "pinv")
    assert study.cells[1].solvers == ("osqp[eps_abs=1e-4]", "osqp[eps_abs=1e-6]")


def test_the_command_line_spreads_too() -> None:
    """The options of `dikbench run` are selectors of the same kind."""
    selection = Selection(formulations=("dls[damping=0.01|0.1]",), scenarios=("reach[gain=1|2]",))
    study = select(load_study("smoke"), selection, named=False)
    assert [cells.formulations for cells in study.cells] == [
        ("dls[damping=0.01]",),
        ("dls[damping=0.1]",),
    ]
    assert study.scenarios == ("reach[gain=1]", "reach[gain=2]")
