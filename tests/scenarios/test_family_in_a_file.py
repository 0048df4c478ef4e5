"""The family that its guide shows: it runs as it stands there."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import numpy as np
import pytest

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.plugins.built_scenarios import built
from dikbench.study.plan import expand
from dikbench.study.selection import Selection, select
from dikbench.study.study import load_study

GUIDE = Path(__file__).parents[2] / "docs" / "guides" / "add-a-family.md"


@pytest.fixture
def line(tmp_path: Path) -> str:
    """The selector of the family, in a file as the guide has it."""
    blocks = re.findall(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    (code,) = [block for block in blocks if "(Family)" in block]
    path = tmp_path / "my_line.py"
    path.write_text(code)
    return f"{path}:StraightLine"


def test_it_is_at_most_forty_lines_of_code(line: str) -> None:
    """Without docstrings, comments and blank lines."""
    code = Path(line.rpartition(":")[0]).read_text()
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.ClassDef):
            code = code.replace(ast.get_docstring(node, clean=False) or "", "")
    lines = [text for text in code.splitlines() if text.strip(' "') and text.strip()[0] != "#"]
    assert 15 < len(lines) <= 40


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("robot", ["panda", "ur5"])
def test_it_is_a_straight_line_at_its_speed(line: str, robot: str, seed: int) -> None:
    """From the start to the left, orientation held, as long and as fast as asked."""
    scenario = make_scenario(f"{line}[robot={robot},speed=0.25,length=0.15]", seed)
    reference = scenario.reference
    start, end = reference.placement(0.0), reference.placement(reference.duration)
    assert end.translation - start.translation == pytest.approx([0.0, 0.15, 0.0])
    for share in (0.1, 0.5, 0.9):
        tau = share * reference.duration
        assert np.linalg.norm(reference.velocity(tau)[:3]) == pytest.approx(0.25)
        middle = reference.placement(tau)
        assert middle.rotation == pytest.approx(start.rotation)
        assert middle.translation == pytest.approx(
            (1 - share) * start.translation + share * end.translation
        )
    assert len(scenario.certificate.claims) == 3


def test_its_ranges_and_its_certificate_are_asserted(line: str) -> None:
    """One line each, with the selector before it."""
    with pytest.raises(DikbenchError) as caught:
        make_scenario(f"{line}[speed=3]")
    assert str(caught.value) == "scenario StraightLine: speed=3.0 must be 0.01 to 2 [m/s]"
    with pytest.raises(DikbenchError) as caught:
        make_scenario(f"{line}[speed=2]")
    assert str(caught.value).startswith(f"certificate of '{line}[speed=2]' failed: ")


def test_a_study_takes_it_and_a_report_does_not_execute_it(line: str) -> None:
    """Selected on the command line it is a scenario like any; in results it is data."""
    selection = Selection(
        formulations=("dls",),
        scenarios=(f"{line}[speed=0.1|0.2]",),
        plants=("ideal",),
        references=("time",),
    )
    planned = expand(select(load_study("quick"), selection, named=False))
    assert len({trial.id for trial in planned}) == len(planned) == 2
    assert "a report does not run" in str(built(line, 0))
