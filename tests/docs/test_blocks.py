"""The blocks of the guides that are no commands run, or are read, as they stand there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from makers.pages import CHECKOUT, blocks_of

import dikbench
from dikbench.scenario.obstacle_file import read_obstacles
from dikbench.solvers.catalogue.back_ends import parse_solver

GUIDES = CHECKOUT / "docs" / "guides"


def test_the_guide_to_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its blocks run one after the other; the study is looked at, and not run."""
    monkeypatch.chdir(CHECKOUT)
    studied: list[dict[str, Any]] = []
    monkeypatch.setattr(dikbench, "run_study", lambda **given: studied.append(given), raising=False)
    names: dict[str, Any] = {}
    for block in blocks_of(GUIDES / "python.md"):
        assert block.language == "python"
        before = dict(names)
        exec(block.text, names)
        if "0.2300097" in block.text:
            assert names["answer"].progress == pytest.approx(0.2300097, abs=1e-6)
            assert names["answer"].status is dikbench.Status.OK
        if "run_study" in block.text:
            names["results"] = before["results"]
    assert studied == [
        {"formulations": ["dls[damping=0.01|0.1]", "qp"], "scenarios": "reach", "out": "runs/mine"}
    ]
    assert names["keep_clear"].distances(names["robot"], names["robot"].q0[None])[0] > 0


def test_the_solvers_of_the_guide_to_what_runs() -> None:
    """Each line of the block is a selector, of which the comment says what it is."""
    (block,) = [
        block.text
        for block in blocks_of(GUIDES / "choose-what-runs.md")
        if block.text.startswith("osqp ")
    ]
    made = [str(parse_solver(line.split("#")[0].strip())) for line in block.splitlines()]
    assert len(set(made)) == len(made) == 6


def test_the_obstacles_of_the_guide_to_an_own_trajectory(tmp_path: Path) -> None:
    """A sphere, a capsule and a box."""
    (block,) = [
        block.text
        for block in blocks_of(GUIDES / "own-robot-and-trajectory.md")
        if block.language == "toml"
    ]
    (tmp_path / "cell.toml").write_text(block)
    kinds = [type(each).__name__ for each in read_obstacles(str(tmp_path / "cell.toml"))]
    assert sorted(kinds) == ["BoxObstacle", "CapsuleObstacle", "SphereObstacle"]


def test_the_files_of_the_guide_to_a_first_run() -> None:
    """Every file of the committed run that it promises is there."""
    said = (GUIDES / "first-run.md").read_text(encoding="utf-8")
    for name in ("report.md", "timing.csv", "tables", "figures", "manifest.json"):
        assert f"`{name}" in said
        assert (CHECKOUT / "results" / "quick" / name).exists()
