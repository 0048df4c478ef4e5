"""What `import dikbench` offers."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from makers.runs import without_workers

import dikbench
from dikbench.problem import tasks
from dikbench.report.comparison.matching import match_trials
from dikbench.report.sentences.limitations import missing


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
    """Also from one without `if __name__ == "__main__"`, which new processes would run again.

    Folders beside it that are called as dikbench's own are do not hide those.
    """
    script = tmp_path / "script.py"
    for name in ("formulations", "scenarios"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").touch()
    (tmp_path / "untimed.toml").write_text(
        'description = "untimed"\nscenarios = ["reach"]\nplants = ["ideal"]\n'
        '[[cells]]\nformulations = ["pinv"]\n'
    )
    script.write_text(
        "import dikbench\n"
        "chosen = {'formulations': 'dls', 'scenarios': 'reach[duration=0.2]'}\n"
        "chosen['references'] = 'time'\n"
        "results = dikbench.run_study('untimed.toml', **chosen, out='out', jobs=1)\n"
        "print(list(results.trials['status']), len(results.steps()))\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert done.stdout.splitlines()[-1] == "['ok'] 20"
    assert (tmp_path / "out" / "report.html").is_file()


def test_documented_tasks_are_public() -> None:
    """Every task that the page of formulations names can be had from `dikbench` itself."""
    page = Path(__file__).parents[2] / "docs" / "reference" / "formulations.md"
    named = set(re.findall(r"`(\w+Task)`", page.read_text(encoding="utf-8")))
    assert len(named) == 6
    for name in named:
        assert getattr(dikbench, name) is getattr(tasks, name)
        assert name in dikbench.__all__


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"references": "phase"}, "unknown references 'phase'; valid: path, time"),
        ({"trial_timeout": -1}, "trial_timeout=-1 must be"),
        ({"trial_memory": 0}, "trial_memory=0 must be"),
        ({"jobs": 0}, "jobs=0 must be"),
        ({"traces": "some"}, "unknown traces 'some'"),
        ({"seeds": ["a"]}, "seeds: expected integers of at least 0, got 'a'"),
        ({"seeds": -1}, "seeds: expected integers of at least 0, got -1"),
        ({"formulations": [3]}, "formulations: expected selectors as text"),
    ],
)
def test_run_study_refuses_what_the_command_line_refuses(
    tmp_path: Path, arguments: dict[str, Any], said: str
) -> None:
    """One line, before anything runs."""
    with pytest.raises(dikbench.DikbenchError) as caught:
        dikbench.run_study(out=tmp_path / "out", **arguments)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_a_trial_in_other_words_is_the_same_trial(tmp_path: Path) -> None:
    """A default that is spelt out: not run twice, not missing, and matched in comparisons."""
    plain: dict[str, Any] = {"formulations": "dls", "scenarios": "reach[duration=0.2]"}
    spelt: dict[str, Any] = {
        "formulations": "dls[damping=0.05]",
        "scenarios": "reach[robot=panda,duration=2e-1]",
    }
    how: dict[str, Any] = {"references": "time", "jobs": 1, "report": False}
    with without_workers():
        one = dikbench.run_study(**plain, **how, out=tmp_path / "one")
        again = dikbench.run_study(**spelt, **how, out=tmp_path / "one")
        other = dikbench.run_study(**plain, **how, out=tmp_path / "other")
    assert list(again.trials["id"]) == list(one.trials["id"])
    assert list(again.trials["formulation"]) == ["dls[damping=0.05]"]
    assert missing(again.trials, again.manifest) == 0
    assert again.trials["formulation_time_median_us"].notna().all()
    matched = match_trials(again.trials, other.trials)
    assert len(matched.a) == 1
    assert len(matched.only_a) == len(matched.only_b) == 0
