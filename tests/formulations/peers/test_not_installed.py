"""Without a peer's package nothing changes but that the peer says how it is installed."""

from __future__ import annotations

import subprocess
import sys

import pytest
from makers.commands import in_process
from makers.scenarios import error_of

import dikbench.problem.problem
from dikbench import load_robot, solve_dik
from dikbench.plugins.finding import plugins
from dikbench.run.timing import time_scenario
from dikbench.run.trial_row import run_trial
from dikbench.selector import Selector
from dikbench.study.trial import Trial
from dikbench.tuning.candidates import tunable
from formulations import FORMULATIONS
from formulations.peers import PEERS

MODULES = ("pink", "mink", "mujoco", "pydrake", "embodik", "jparse_robotics")
COMMANDS = {"peer-drake": "drake", "peer-drake-system": "drake"}


@pytest.fixture
def nothing_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hide the peers' packages."""
    monkeypatch.setattr(dikbench.problem.problem, "find_spec", lambda name: None)


def reason(name: str) -> str:
    """How a peer says that it is not installed, after the module's name."""
    return f'is not installed: pip install "dikbench[{COMMANDS.get(name, "peers")}]"'


def test_modules_are_imported_without_the_packages() -> None:
    """In a process in which none of them can be imported every peer is listed, with a command."""
    script = (
        f"import sys; sys.modules.update(dict.fromkeys({MODULES}))\n"
        "from dikbench.cli import main\n"
        "sys.argv = ['dikbench', 'list', 'formulations']\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60
    )
    listed = {line.partition(" ")[0]: line for line in done.stdout.splitlines()}
    for name in PEERS:
        assert reason(name) in listed[name]
    for name in FORMULATIONS:
        assert "not installed" not in listed[name]


@pytest.mark.usefixtures("nothing_installed")
@pytest.mark.parametrize("name", PEERS)
def test_one_line_where_it_is_asked(name: str) -> None:
    """At the prompt, in a trial, in the timing pass and by the contract suite."""
    robot = load_robot("panda")
    said = error_of(
        lambda: solve_dik(robot, robot.q0, formulation=name, twist=[0.1, 0, 0, 0, 0, 0])
    )
    assert reason(name) in said
    row = run_trial(Trial.of(name, "reach[duration=0.2]", "none"))
    assert row["status"] == "skipped"
    assert str(row["message"]).endswith(reason(name))
    cells = [(Selector(name), Selector("none"))]
    (timed,) = time_scenario(Selector("reach"), 0, cells, "dls", problems=1, rounds=1)
    assert "timing_samples" not in timed
    checked = in_process("check", name)
    assert checked.exit_code == 2
    assert f"formulation {name}: " in checked.output
    assert reason(name) in checked.output
    assert "Traceback" not in checked.output


def test_peers_are_not_among_all_formulations() -> None:
    """What goes over all of them does not depend on what is installed; names do not clash."""
    assert set(plugins("formulation")) & set(PEERS) == set()
    assert {each.name for each in tunable()} & set(PEERS) == set()
    assert set(plugins("peer")) == set(PEERS)
