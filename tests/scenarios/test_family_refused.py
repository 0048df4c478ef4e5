"""What `dikbench check` refuses of a family and would make its rows meaningless does not run."""

from __future__ import annotations

from pathlib import Path

import pytest

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.study.plan import expand
from dikbench.study.selection import Selection, select
from dikbench.study.study import load_study

FAMILIES = '''
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from dikbench.scenario import PoseTask, Range
from scenarios.reach import Reach
from scenarios.speed_sweep import SpeedSweep


@dataclass(frozen=True, kw_only=True)
class Fitting(SpeedSweep):
    """As it should be."""


@dataclass(frozen=True, kw_only=True)
class Away(SpeedSweep):
    """Starts elsewhere than its motion."""

    def case(self, robot, change):
        case = super().case(robot, change)
        return replace(case, q0=case.q0 + 0.01)


@dataclass(frozen=True, kw_only=True)
class OtherFrame(SpeedSweep):
    """Follows the path of one frame with another."""

    def case(self, robot, change):
        return replace(super().case(robot, change), tracking=PoseTask(frame="panda_link7"))


@dataclass(frozen=True, kw_only=True)
class Repelled(Reach):
    """Moves away from its target."""

    def case(self, robot, change):
        return replace(super().case(robot, change), tracking=PoseTask(gain=-5.0))


@dataclass(frozen=True, kw_only=True)
class Nowhere(Reach):
    """Starts at NaN."""

    def scenario(self, seed=0):
        made = super().scenario(seed)
        return replace(made, q0=made.q0 * np.nan)


@dataclass(frozen=True, kw_only=True)
class Boundless(Reach):
    """Has a number that may be anything."""

    stretch: float = 1.0


@dataclass(frozen=True, kw_only=True)
class PerhapsBoundless(Reach):
    """Has one that may be nothing, too."""

    stretch: int | None = None
'''

FAULTS = {
    "Away": "motion.q[0] is 0.01 rad away from q0; valid: a motion that begins at q0",
    "OtherFrame": "tracking follows the frame 'panda_link7', the reference is for",
    "Repelled": "tracking.gain is -5.0; valid: finite and above 0 [1/s]",
    "Nowhere": "q0 must be 7 finite numbers, got [nan",
    "Boundless": "stretch is a number without a Range; valid: stretch: Annotated[float, Range(",
    "PerhapsBoundless": "stretch is a number without a Range; valid: ",
}


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with a family for each fault."""
    path = tmp_path_factory.mktemp("refused") / "refused_families.py"
    path.write_text(FAMILIES)
    return path


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_refused_where_the_scenario_is_built(file: Path, name: str) -> None:
    """In one line that says what is valid, and names the family."""
    with pytest.raises(DikbenchError) as caught:
        make_scenario(f"{file}:{name}")
    message = str(caught.value)
    assert FAULTS[name] in message
    assert name in message
    assert "\n" not in message


def test_a_run_of_such_a_family_is_refused_before_it_begins(file: Path) -> None:
    """As one scenario among others, the study and the selector named."""
    chosen = Selection(formulations=("dls",), scenarios=("reach", f"{file}:Away"))
    with pytest.raises(DikbenchError, match=r"study selection: .*:Away.* away from q0; valid: "):
        expand(select(load_study("quick"), chosen, named=False))


def test_what_fits_is_built(file: Path) -> None:
    """The same family without the fault."""
    assert make_scenario(f"{file}:Fitting").certificate.claims
