"""What is tried for a formulation."""

from __future__ import annotations

from collections import Counter
from math import log
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.errors import DikbenchError
from dikbench.parameters import Drawn
from dikbench.plugins.building import make_formulation
from dikbench.plugins.drawing import scaled
from dikbench.plugins.tuned import ranges_of
from dikbench.selector import Selector, parse_selector
from dikbench.tuning.candidates import at_edge, candidates, share, tunable

PICKY = """
from dataclasses import dataclass
from typing import Annotated
import numpy as np
from dikbench.errors import DikbenchError
from dikbench.parameters import Drawn, Parameters, Range

@dataclass(frozen=True)
class Picky(Parameters):
    '''Refuse all above a limit.'''

    most: float = 0.5
    a: Annotated[float, Range(0.0, 1.0), Drawn(0.0, 1.0)] = 0.1

    def check(self):
        if self.a > self.most:
            raise DikbenchError(f"a={self.a} must be at most {self.most}")

    def velocity(self, problem, solve):
        return np.zeros(problem.jacobian.shape[1])
"""


@pytest.mark.parametrize("selector", tunable(), ids=str)
def test_candidates_lie_in_their_ranges_and_can_be_made(selector: Selector) -> None:
    """The class accepts each, within its own ranges, no two alike and none drawn by chance."""
    made = candidates(selector, 8, seed=0)
    ranges = ranges_of(selector)
    assert len(set(made)) == len(made) == 8
    assert made == candidates(selector, 8, seed=0)
    assert made != candidates(selector, 8, seed=1)
    for candidate in made:
        make_formulation(candidate)
        assert candidate == parse_selector(str(candidate))
        assert set(candidate.parameters) == set(ranges)
        for name, drawn in ranges.items():
            assert drawn.low <= float(candidate.parameters[name]) <= drawn.high


def test_each_part_of_the_range_has_its_candidate() -> None:
    """Of 16 points of a scrambled net in one dimension each sixteenth holds one."""
    drawn = ranges_of(Selector("dls"))["damping"]
    shares = [
        share(drawn, float(each.parameters["damping"]))
        for each in candidates(Selector("dls"), 16, 3)
    ]
    assert Counter(int(16 * u) for u in shares) == Counter(range(16))


def test_half_a_budget_is_the_first_half() -> None:
    """Whoever doubles the budget keeps what was run."""
    law = Selector("neo")
    assert candidates(law, 16, 0)[:8] == candidates(law, 8, 0)


def test_a_parameter_that_is_given_stays() -> None:
    """`lm[damping=0.02]` is tuned in its other parameter."""
    made = candidates(parse_selector("lm[damping=0.02]"), 4, 0)
    assert {each.parameters["damping"] for each in made} == {"0.02"}
    assert len({each.parameters["error_factor"] for each in made}) == 4


def test_refused_points_are_passed_over(tmp_path: Path) -> None:
    """The budget is of what can be run; a formulation that refuses nearly all is named."""
    file = tmp_path / "picky.py"
    file.write_text(PICKY)
    made = candidates(Selector(f"{file}:Picky"), 8, 0)
    assert len(made) == 8
    assert all(float(each.parameters["a"]) <= 0.5 for each in made)
    with pytest.raises(DikbenchError, match=r"accepts \d+ of 32 points .* must be at most 0.01"):
        candidates(Selector(f"{file}:Picky", {"most": "0.01"}), 8, 0)


def test_a_whole_number_is_tried_whole(tmp_path: Path) -> None:
    """Where it has fewer values than the budget has points, each once."""
    file = tmp_path / "whole.py"
    real = "a: Annotated[float, Range(0.0, 1.0), Drawn(0.0, 1.0)] = 0.1"
    text = PICKY.replace(real, "a: Annotated[int, Range(0, 9), Drawn(1, 4)] = 1")
    file.write_text(text.replace("most: float = 0.5", "most: float = 9.0"))
    made = candidates(Selector(f"{file}:Picky"), 16, 0)
    assert sorted(each.parameters["a"] for each in made) == ["1", "2", "3", "4"]


def test_nothing_to_tune_is_said() -> None:
    """The error says which formulations have something."""
    with pytest.raises(DikbenchError, match=r"'pinv' has no parameter to tune; valid: .*dls"):
        candidates(Selector("pinv"), 4, 0)


@given(st.floats(1e-4, 0.9), st.floats(1.1, 1e3), st.booleans(), st.floats(0, 1))
def test_share_is_the_inverse_of_scaled(low: float, factor: float, log: bool, u: float) -> None:
    """There and back, linear and logarithmic."""
    drawn = Drawn(low, low * factor, log=log)
    assert share(drawn, scaled(drawn, u)) == pytest.approx(u, abs=1e-9)


def test_a_logarithmic_range_is_even_in_its_logarithm() -> None:
    """Halfway is the geometric mean."""
    assert log(scaled(Drawn(0.01, 1.0, log=True), 0.5)) == pytest.approx(log(0.1))


def test_a_value_at_an_end_is_named() -> None:
    """A wider range may have a better one."""
    law, drawn = Selector("dls"), ranges_of(Selector("dls"))["damping"]
    for u, named in ((0.0, ["damping"]), (0.5, []), (0.999, ["damping"])):
        assert at_edge(law, Selector("dls", {"damping": repr(scaled(drawn, u))})) == named
    assert at_edge(law, law) == []
