from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

LAW = '''
from __future__ import annotations
from dataclasses import dataclass

@dataclass(frozen=True)
class MyLaw:
    """The transpose of the Jacobian.

    Source: a test.
    """

    gain: float = 1.0

    def velocity(self, problem, solve):
        return self.gain * problem.primary.J.T @ problem.primary.V
'''


def dikbench(
    *arguments: str, cwd: Path, path: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process of its own."""
    environment = dict(os.environ)
    if path is not None:
        environment["PYTHONPATH"] = str(path)
    return subprocess.run(
        [sys.executable, "-c", "from dikbench.cli import main; main()", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        env=environment,
        timeout=300,
        check=False,
    )


def test_help_does_not_import_anything_heavy() -> None:
    """`dikbench --help` imports neither numpy nor Pinocchio nor pandas."""
    code = (
        "import sys\n"
        "from dikbench.cli import commands\n"
        "commands.main(['--help'], standalone_mode=False)\n"
        "heavy = {'numpy', 'pinocchio', 'pandas', 'scipy', 'qpsolvers', 'cvxpy', 'matplotlib'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "run" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("run", "nosuch"), ("nosuch", "quick")),
        (("run", "--formulation", "dls[damping=many]"), ("damping", "float")),
        (("run", "--formulation", "dls[dampin=1]"), ("dampin", "valid: damping")),
        (("run", "--formulation", "nofile.py:Law"), ("nofile.py",)),
        (("run", "--solver", "osqp[eps=1]"), ("eps", "eps_abs")),
        (("run", "--scenario", "reach[robot=bad.urdf,frame=tip]"), ("bad.urdf", "URDF")),
        (("run", "--scenario", "near-miss[robot=ur5,singularity=elbow]"), ("elbow", "wrist")),
        (("run", "--scenario", "reach[duration=1e15]"), ("steps", "valid")),
        (("run", "--plant", "perfect"), ("perfect", "ideal")),
        (("run", "--reference", "space"), ("space", "path")),
        (("run", "--seed", "-1"), ("-1",)),
        (("run", "--out", "afile/inside", "--formulation", "dls"), ("afile/inside",)),
        (("list", "laws"), ("laws", "formulations")),
        (("show", "nothing"), ("nothing", "valid")),
        (("--plnt",), ("--plnt",)),
    ],
)
def test_malformed_input_is_one_line_and_exit_code_two(
    tmp_path: Path, arguments: tuple[str, ...], expected: tuple[str, ...]
) -> None:
    """Whatever is wrong with a command: one line, exit code 2, no traceback, nothing written."""
    (tmp_path / "bad.urdf").write_text("<robot name='x'>")
    (tmp_path / "afile").touch()
    before = sorted(tmp_path.rglob("*"))
    done = dikbench(*arguments, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert done.stderr.startswith("error: ")
    for part in expected:
        assert part in done.stderr
    assert sorted(tmp_path.rglob("*")) == before


def test_a_failed_command_touches_no_earlier_results(tmp_path: Path) -> None:
    """A malformed second run leaves the files of the first as they were."""
    out = tmp_path / "out"
    good = dikbench(
        "run", "--formulation", "dls", "--scenario", "reach", "--plant", "ideal",
        "--out", str(out), cwd=tmp_path,
    )  # fmt: skip
    assert good.returncode == 0, good.stderr
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert dikbench("run", "--formulation", "dlss", "--out", str(out), cwd=tmp_path).returncode == 2
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_a_plugin_of_another_project_is_listed_and_runs(tmp_path: Path) -> None:
    """A project with its own entry points adds a law and a family without touching dikbench."""
    site = tmp_path / "site"
    info = site / "my_project-1.0.dist-info"
    info.mkdir(parents=True)
    (site / "my_laws.py").write_text(LAW + '\nFORMULATIONS = {"my-law": MyLaw}\n')
    (site / "my_scenarios.py").write_text(
        "from scenarios.reach import reach\n"
        "def my_family(distance: float = 0.05, *, seed: int = 0):\n"
        '    """A short reach."""\n'
        "    return reach(distance=distance, seed=seed)\n"
        'SCENARIOS = {"my-family": my_family}\n'
    )
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-project\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[dikbench.formulations]\nmine = my_laws\n[dikbench.scenarios]\nmine = my_scenarios\n"
    )
    listed = dikbench("list", cwd=tmp_path, path=site)
    assert listed.returncode == 0, listed.stderr
    assert "my-law" in listed.stdout
    assert "my-family" in listed.stdout
    done = dikbench(
        "run", "--formulation", "my-law[gain=2]", "--scenario", "my-family[distance=0.1]",
        "--plant", "ideal", "--out", "out", cwd=tmp_path, path=site,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    trials = pd.read_csv(tmp_path / "out" / "trials.csv")
    assert list(trials["formulation"]) == ["my-law[gain=2]"]
    assert list(trials["status"]) == ["ok"]


def test_a_law_in_a_file_runs_without_packaging(tmp_path: Path) -> None:
    """`path/to/file.py:Class` is resolved in each worker from its text, with parameters."""
    (tmp_path / "my_law.py").write_text(LAW)
    done = dikbench(
        "run", "--formulation", "my_law.py:MyLaw", "--formulation", "my_law.py:MyLaw[gain=2]",
        "--scenario", "reach", "--out", "out", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    trials = pd.read_csv(tmp_path / "out" / "trials.csv")
    assert set(trials["status"]) == {"ok"}
    by_law = trials[trials["plant"] == "ideal"].set_index("formulation")["progress_mean"]
    assert by_law["my_law.py:MyLaw[gain=2]"] > by_law["my_law.py:MyLaw"]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("qp", "min_v"),
        ("near-miss[miss=0.05]", "required speed over limit"),
        ("osqp", "eps_abs"),
        ("panda", "panda_hand_tcp"),
        ("off_course_max_rad", "unit: rad"),
        ("quick", "[[cells]]"),
    ],
)
def test_show_prints_one_thing_in_full(tmp_path: Path, name: str, expected: str) -> None:
    """`dikbench show` knows laws, scenarios, solvers, robots, metrics and studies."""
    done = dikbench("show", name, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert expected in done.stdout
