"""The README: short, and true where it can be held against something."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from makers.pages import CHECKOUT, PAGES, README, blocks_of, files_of

from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.robots.loading import load_robot
from dikbench.simulation.one_step import solve_dik

TEXT = README.read_text(encoding="utf-8")
MOST_WORDS = 1000
LARGEST_PICTURE = 2_000_000
"""Bytes."""


def test_it_is_short() -> None:
    """Code, tables and links included."""
    assert len(TEXT.split()) <= MOST_WORDS


def test_its_findings_are_those_of_the_committed_tables() -> None:
    """As the command that it names prints them."""
    command = "docs/findings_table.py"
    assert f"`python {command}`" in TEXT
    printed = subprocess.run(
        [sys.executable, command], cwd=CHECKOUT, capture_output=True, text=True, check=True
    )
    assert printed.stdout.count("\n") == 8
    assert printed.stdout in TEXT, f"the table is now:\n{printed.stdout}"


def test_its_sample_is_that_of_the_committed_tables() -> None:
    """How many scenarios of how many robots each column is over."""
    table = (CHECKOUT / "results" / "full" / "tables" / "success.md").read_text(encoding="utf-8")
    numbers = {"two": 2, "three": 3, "four": 4, "six": 6}
    said = " ".join(TEXT.split())
    for sentence, situation in (
        ("14 scenarios of three arms near singularities", "near singularities"),
        ("13 of six robots at joint limits", "at joint limits"),
        ("5 of two arms beyond joint speed", "beyond joint speed"),
        ("17 of four robots in free space", "free space"),
    ):
        assert sentence in said
        scenarios, robots = sentence.split()[0], numbers[sentence.split(" of ")[1].split()[0]]
        line = next(line for line in table.splitlines() if line.startswith(f"- {situation}: "))
        assert f"({scenarios} scenarios of {robots} robots" in line


def test_its_step_is_the_one_of_drake() -> None:
    """The block runs as it stands; the share that it prints is the one that Drake gives too."""
    (step,) = [block.text for block in blocks_of(README) if "solve_dik" in block.text]
    assert len(step.splitlines()) <= 8
    names: dict[str, Any] = {}
    exec(step, names)
    assert names["answer"].progress == pytest.approx(0.2300097, abs=1e-6)


def test_its_law_is_short_and_a_gradient(tmp_path: Path) -> None:
    """Twelve lines; it answers J^T V."""
    law = files_of(README)["my_law.py"]
    assert len([line for line in law.splitlines() if line.strip()]) <= 12
    (tmp_path / "my_law.py").write_text(law)
    robot = load_robot("ur5")
    twist = np.array([0.1, 0.2, 0.0, 0.0, 0.3, 0.0])
    selector = f"{tmp_path / 'my_law.py'}:Transpose"
    answer = solve_dik(robot, robot.q0, twist=twist, formulation=make_formulation(selector))
    exact = solve_dik(robot, robot.q0, twist=twist, formulation="pinv").velocity
    assert answer.velocity @ exact == pytest.approx(twist @ twist)  # (J^T V)^T J^-1 V = |V|^2


def test_its_family_is_short_and_a_line(tmp_path: Path) -> None:
    """Thirty lines; the target moves to the left at the speed."""
    family = files_of(README)["my_line.py"]
    assert len(family.splitlines()) <= 32
    assert len([line for line in family.splitlines() if line.strip()]) <= 30
    (tmp_path / "my_line.py").write_text(family)
    reference = make_scenario(f"{tmp_path / 'my_line.py'}:Line[robot=ur5,speed=0.1]").reference
    start, end = (reference.placement(tau).translation for tau in (0.0, reference.duration))
    assert end - start == pytest.approx([0.0, 0.2, 0.0])
    assert reference.duration == pytest.approx(2.0)


def test_its_picture_is_small() -> None:
    """It is loaded by everybody who looks at the project."""
    picture = CHECKOUT / "docs" / "pictures" / "near_miss.gif"
    assert f"({picture.relative_to(CHECKOUT)})" in TEXT
    assert 10_000 < picture.stat().st_size <= LARGEST_PICTURE


def test_its_set_up_is_what_the_clean_clone_runs() -> None:
    """The two commands, character for character."""
    clean = (CHECKOUT / ".ci" / "run").read_text(encoding="utf-8")
    set_up = 'python3 -m venv .venv && .venv/bin/pip install -c constraints.txt -e ".[test]" && '
    found = [block.text for block in blocks_of(README) if block.text.startswith("python3")]
    assert found == [f"{set_up}.venv/bin/dikbench run\n", f"{set_up}.venv/bin/pytest\n"]
    assert f"\n{found[1]}" in clean


def test_every_link_of_the_pages_leads_somewhere() -> None:
    """To a file of the checkout; links to the net are not followed."""
    for page in (*PAGES, CHECKOUT / "CONTRIBUTING.md"):
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), f"{page}: {target}"


def test_one_version() -> None:
    """To cite is the version that is installed."""
    cited = (CHECKOUT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {version('dikbench')}\n" in cited


def test_its_map_is_that_of_the_rooms() -> None:
    """In the order in which they may import; the page of the map has a line for each."""
    listed = re.search(r"^dikbench/ +(.*?):", TEXT, re.M | re.S)
    assert listed is not None
    rooms = re.findall(r"\w+", listed[1])
    page = (CHECKOUT / "docs" / "explanation" / "map.md").read_text(encoding="utf-8")
    assert re.findall(r"^  (\w+)/ ", page, re.M) == rooms
    assert set(rooms) == {
        each.name for each in (CHECKOUT / "dikbench").iterdir() if (each / "__init__.py").is_file()
    }
