"""`dikbench new`: a project of its own that is checked, installed and tested."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from makers.commands import in_process
from makers.few_states import few_states


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a new formulation."""
    monkeypatch.chdir(tmp_path)
    done = in_process("new", "formulation", "brand-new")
    assert done.exit_code == 0, done.output
    return tmp_path / "brand-new"


def test_a_new_project_is_installed_and_its_tests_pass(made: Path, tmp_path: Path) -> None:
    """By pip, into a folder; its formulation is then one of those that are listed."""
    target = tmp_path / "installed"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run(
        [*pip, "--no-index", "--target", str(target), str(made)], check=True, timeout=300
    )
    code = (
        "import sys, pytest\n"
        "from dikbench.plugins.finding import plugins\n"
        "assert 'brand-new' in plugins('formulation')\n"
        "sys.exit(pytest.main(['-q', '-p', 'no:cacheprovider', '-p', 'no:xdist', 'tests']))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=made,
        env={**os.environ, "PYTHONPATH": str(target)},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "18 passed" in done.stdout


@pytest.mark.parametrize("kind", ["formulation", "family"])
def test_a_new_project_is_checked_as_it_is(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without being installed: each promise is kept or not given."""
    monkeypatch.chdir(tmp_path)
    name = f"untried-{kind}"
    assert in_process("new", kind, name).exit_code == 0
    with few_states(1, 20):
        done = in_process("check", name)
    assert done.exit_code == 0, done.output
    assert f"{'scenario' if kind == 'family' else kind} {name}:" in done.output
    assert "BROKEN" not in done.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("formulation", "dls"), "a formulation is called 'dls' already"),
        (("family", "reach"), "a family is called 'reach' already"),
        (("formulation", "My Law"), "is not valid; valid: small letters"),
        (("formulation", "../law"), "is not valid; valid: small letters"),
        (("formulation", "json"), "a module 'json' is here already"),
        (("formulation", "numpy"), "a module 'numpy' is here already"),
        (("solver", "x"), "'formulation', 'family'"),
    ],
)
def test_what_cannot_be_made_is_one_line(
    arguments: tuple[str, str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And nothing is written."""
    monkeypatch.chdir(tmp_path)
    done = in_process("new", *arguments)
    assert done.exit_code == 2
    assert said in " ".join(done.output.split())
    assert not [*tmp_path.iterdir()]


def test_a_folder_that_is_not_empty_is_left_alone(made: Path) -> None:
    """What the author wrote since is not written over."""
    before = {path: path.read_text() for path in made.rglob("*") if path.is_file()}
    done = in_process("new", "formulation", "another", "--out", str(made))
    assert done.exit_code == 2
    assert "is not empty; valid: another one with --out" in done.output
    assert {path: path.read_text() for path in made.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no entry points of dikbench; valid: dikbench.formulations"),
        ("[project", "not valid TOML"),
        ('[project.entry-points."dikbench.solvers"]\nx = "nowhere_at_all"', "cannot be imported"),
        ('[project.entry-points."dikbench.solvers"]\nx = "json"', "holds no mapping SOLVERS"),
    ],
)
def test_a_folder_that_is_no_project_is_one_line(text: str, said: str, tmp_path: Path) -> None:
    """What, in which file, and what would be one."""
    (tmp_path / "pyproject.toml").write_text(text)
    done = in_process("check", str(tmp_path))
    assert done.exit_code == 2
    assert said in done.output
    assert done.output.count("\n") == 1
