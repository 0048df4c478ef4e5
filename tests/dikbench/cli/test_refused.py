"""Commands that are refused: one line, and nothing is touched."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from makers.commands import in_process, run_all

ON_REACH = ("run", "--scenario", "reach")
"""Of one scenario: those of a whole study would be built before some faults are found."""


MALFORMED = [
    (("run", "nosuch"), ("nosuch", "quick")),
    ((*ON_REACH, "--formulation", "dls[damping=many]"), ("damping", "a number, finite and")),
    (("run", "--formulation", "dls[dampin=1]"), ("dampin", "valid: damping")),
    (("run", "--formulation", "nofile.py:Formulation"), ("nofile.py",)),
    ((*ON_REACH, "--solver", "osqp[eps=1]"), ("eps", "eps_abs")),
    (("run", "--scenario", "reach[robot=bad.urdf,frame=tip]"), ("bad.urdf", "URDF")),
    (("run", "--scenario", "near-miss[robot=talos,singularity=wrist]"), ("wrist", "elbow")),
    (("run", "--scenario", "reach[gain=1||2]"), ("gain", "empty")),
    ((*ON_REACH, "--plant", "ideal[delay=-1]"), ("delay=-1", "0 to")),
    ((*ON_REACH, "train", "--seed", "0"), ("seed 0", "1 to 99")),
    (("show", "near-miss", "--figure", "a.gif"), ("a.gif", ".svg, .png, .pdf")),
    (("show", "near-miss", "--figure", "no/such/a.png"), ("no/such/a.png", "No such file")),
    (("show", "dls", "--figure", "a.png"), ("dls", "dikbench list scenarios")),
    (("run", "--scenario", "reach[duration=1e15]"), ("steps", "valid")),
    ((*ON_REACH, "--plant", "perfect"), ("perfect", "ideal")),
    (("run", "--reference", "space"), ("space", "path")),
    (("run", "--seed", "-1"), ("-1",)),
    ((*ON_REACH, "--out", "afile/inside", "--formulation", "dls"), ("afile/inside",)),
    (("recompute", "nowhere"), ("no results", "nowhere")),
    (("list", "laws"), ("laws", "formulations")),
    (("show", "nowhere.urdf"), ("robot file not found: nowhere.urdf",)),
    (("show", "bad.urdf"), ("robot file bad.urdf is not a URDF, which is XML",)),
    (("show", "csv[file=none.csv]"), ("none.csv",)),
    (("check", "csv"), ("'file' must be given; valid: csv[file=...], a text",)),
    (("run", "--scenario", "csv"), ("valid: csv[file=...], a text",)),
    (("show", "nothing"), ("nothing", "valid", "dikbench list")),
    (("show", "dls[dampin=1]"), ("dampin", "valid: damping")),
    (("show", "dls[damping=-1]"), ("damping=-1.0", "finite and at least 0")),
    (("show", "osqp[eps=1]"), ("eps", "eps_abs")),
    (("show", "saturating[delay=x]"), ("delay='x'", "a whole number, 0 to 1000 [steps]")),
    (("show", "panda[x=1]"), ("unknown parameter of robot panda 'x'", "valid: acceleration")),
    (("show", "nowhere.xacro[lock=j1]"), ("robot file not found: nowhere.xacro",)),
    (("show", "panda[lock=elbow]"), ("unknown joint 'elbow' of robot panda", "panda_joint1")),
    (("show", "quick[x=1]"), ("quick has no parameters", "valid in brackets")),
    (("show", "lag_max_s[x=1]"), ("lag_max_s has no parameters",)),
    (("show", "nofile.py:Family"), ("error: file not found: nofile.py",)),
    (
        ("show", "bad.py"),
        ("bad.py names a file without a class; valid: bad.py:Law, bad.py:Thawed, bad.py:Way",),
    ),
    (("run", "--scenario", "bad.py"), ("bad.py:Way",)),
    (("run", "--formulation", "bad.py"), ("bad.py:Law",)),
    ((*ON_REACH, "--formulation", "bad.py:Thawed"), ("bad.py:Thawed", "@dataclass(frozen=True)")),
    (
        ("run", "--formulation", "bad.py:Low"),
        ("'Low'", "did you mean 'Law'", "valid: Law, Thawed, Way"),
    ),
    (("run", "bad.toml"), ("study bad.toml: cells[0].formulations: ", "damping='x'", "a number")),
    (("--plnt",), ("--plnt",)),
]


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """What came of the malformed commands, in their order."""
    return run_all(tmp_path_factory.mktemp("refused"), [arguments for arguments, _ in MALFORMED])


@pytest.mark.parametrize("number", range(len(MALFORMED)), ids=lambda n: " ".join(MALFORMED[n][0]))
def test_malformed_input_is_one_line_and_exit_code_two(refused: list[Path], number: int) -> None:
    """Whatever is wrong with a command: one line, exit code 2, no traceback, nothing written."""
    folder, (_, expected) = refused[number], MALFORMED[number]
    said = (folder / "stderr").read_text()
    assert (folder / "code").read_text() == "2", said
    assert (folder / "stdout").read_text() == ""
    assert len(said.strip().splitlines()) == 1, said
    assert said.startswith("error: ")
    for part in expected:
        assert part in said
    assert len(said) < 350
    written = {path.name for path in (folder / "cwd").rglob("*")} - {"__pycache__"}
    assert {name for name in written if not name.endswith(".pyc")} == {
        "afile",
        "bad.py",
        "bad.toml",
        "bad.urdf",
        "gantry.urdf",
        "needs.py",
        "untimed.toml",
    }


def test_a_failed_command_touches_no_earlier_results(results: Path, tmp_path: Path) -> None:
    """A malformed second run leaves the files of the first as they were."""
    out = tmp_path / "out"
    shutil.copytree(results, out)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert len(before) > 10
    assert in_process("run", "--formulation", "dlss", "--out", str(out)).exit_code == 2
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before
