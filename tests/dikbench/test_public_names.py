"""What `import dikbench` offers."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import dikbench
from dikbench.problem import tasks


def test_every_public_name_is_there() -> None:
    """Each resolves, to the object that its module defines under this name."""
    for name in {*dikbench.__all__} - {"__version__"}:
        assert getattr(dikbench, name).__name__ == name


def test_dir_shows_the_public_names_and_the_doors() -> None:
    """In a new process, before anything else is imported; a door can be used at once."""
    code = (
        "import dikbench; names = dir(dikbench); assert {*dikbench.__all__} <= {*names}; "
        "assert all(hasattr(getattr(dikbench, door), '__all__') for door in "
        "('problem', 'scenario', 'metrics', 'testing')); print(dikbench.__version__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == version("dikbench")


def test_python_m_dikbench_is_the_command() -> None:
    """It prints what `dikbench` prints, under the command's own name."""
    command = [sys.executable, "-m", "dikbench", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == f"dikbench, version {version('dikbench')}"


def test_a_study_runs_from_a_script_as_from_the_command_line(tmp_path: Path) -> None:
    """Also from one without `if __name__ == "__main__"`, which new processes would run again."""
    script = tmp_path / "script.py"
    script.write_text(
        "import dikbench\n"
        "chosen = {'formulations': 'dls', 'scenarios': 'reach[duration=0.2]', 'plants': 'ideal'}\n"
        "results = dikbench.run_study(**chosen, out='out', jobs=1)\n"
        "print(list(results.trials['status']), len(results.steps()))\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert done.stdout.splitlines()[-1] == "['ok'] 20"
    assert (tmp_path / "out" / "report.html").is_file()


def test_tasks_of_the_readme_are_public() -> None:
    """Every task that the README names can be had from `dikbench` itself."""
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(\w+Task)`", readme))
    assert len(named) == 6
    for name in named:
        assert getattr(dikbench, name) is getattr(tasks, name)
        assert name in dikbench.__all__
