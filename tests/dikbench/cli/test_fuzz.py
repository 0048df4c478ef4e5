"""Whatever is typed or written: one line and exit code 2, or something valid; never a traceback.

(`tests/faults/fuzz.py` tries more.)
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import dikbench.report.write
import dikbench.run.runner
from dikbench import cli
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation, scenario_parameters
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.study.plan import expand
from dikbench.study.study import Study, load_study

EXAMPLES = int(os.environ.get("DIKBENCH_FUZZ", "1200"))

VALID = """\
description = "short"
scenarios = ["reach[duration=0.1]"]
plants = ["ideal"]
references = ["time"]
seeds = [0]
example = "reach[duration=0.1]"

[[cells]]
formulations = ["dls", "pinv[after=clip]"]

[[cells]]
formulations = ["qp[damping=0.01]"]
solvers = ["daqp", "osqp[interface=warm]"]

[timing]
reference = "dls"
problems = 10
rounds = 2
"""

PIECES = (
    "dls", "qp", "reach", "near-miss", "daqp", "osqp", "pinv", "[", "]", "=", ",", "\n", '"', "'",
    "nan", "inf", "-1", "0", "1e999", "99999999999999999999", "damping", "interface=warm",
    "preset=high", "preset=", "seed=1", "robot=panda", "miss=0.02", "true", "null", "{", "}", "#",
    "../../etc/passwd", "x.py:Y", "\x00", "é", "\ud7ff", " ", "\t", "[[cells]]", "[timing]", "none",
    "!!python/object/apply:os.system", "__import__('os')", "eps_abs=0", "max_iter=1",
)  # fmt: skip

texts = st.one_of(st.text(max_size=30), st.lists(st.sampled_from(PIECES), max_size=8).map("".join))


@st.composite
def studies(draw: st.DrawFn) -> str:
    """A valid study with a few places overwritten, dropped, doubled; or anything."""
    if draw(st.integers(0, 9)) == 0:
        return draw(texts)
    text = VALID
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, len(text)))
        end = min(len(text), place + draw(st.integers(0, 12)))
        text = text[:place] + draw(texts) + text[end:]
    return text


@st.composite
def selectors(draw: st.DrawFn) -> str:
    """A name with parameters, more or less."""
    name = draw(st.one_of(st.sampled_from(["dls", "qp", "daqp", "osqp", "near-miss"]), texts))
    inside = draw(st.lists(texts, max_size=3))
    return (
        name
        + draw(st.sampled_from(["[", "[[", ""]))
        + ",".join(inside)
        + draw(st.sampled_from(["]", "]]", ""]))
    )


def _one_line(error: DikbenchError) -> None:
    assert str(error).strip()
    assert len(" ".join(str(error).split())) < 20_000


@pytest.mark.filterwarnings("ignore")
@settings(max_examples=EXAMPLES // 4, deadline=None, suppress_health_check=list(HealthCheck))
@given(text=studies())
def test_a_study_file_is_valid_or_one_line(text: str) -> None:
    """Read, expanded and turned into data again."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        try:
            study = load_study(str(path))
            if len(study.seeds) * len(study.scenarios) < 20:
                expand(study)
        except DikbenchError as error:
            _one_line(error)
            return
        assert msgspec.convert(msgspec.to_builtins(study), Study) == study


@settings(max_examples=EXAMPLES // 4, deadline=None, suppress_health_check=list(HealthCheck))
@given(text=selectors())
def test_a_selector_is_valid_or_one_line(text: str) -> None:
    """Of a formulation, a scenario and a solver."""
    for read in (make_formulation, scenario_parameters, parse_solver):
        try:
            read(text)
        except DikbenchError as error:
            _one_line(error)


OPTIONS = (
    "--formulation", "--scenario", "--solver", "--seed", "--plant", "--reference", "--jobs",
    "--out", "--rerun", "--trial-timeout", "--trial-memory", "--traces", "--help", "-h",
    "--shard", "--executor", "--scheduler",
)  # fmt: skip

command_lines = st.lists(
    st.one_of(
        st.sampled_from(OPTIONS),
        st.sampled_from(["run", "time", "status", "list", "show", "merge", "quick", "smoke"]),
        st.sampled_from(
            ["dls", "qp", "daqp", "reach[duration=0.1]", "ideal", "1", "failed", "2/3", "dask"]
        ),
        texts,
    ),
    min_size=1,
    max_size=6,
)


@pytest.mark.filterwarnings("ignore")
@settings(
    max_examples=EXAMPLES // 4,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
@given(arguments=command_lines)
def test_a_command_line_is_valid_or_one_line(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 0, or 2 with one line; nothing is run here, and nothing written."""
    with pytest.MonkeyPatch.context() as patch, tempfile.TemporaryDirectory() as folder:
        patch.setattr(dikbench.run.runner, "run_study", _nothing)
        patch.setattr(dikbench.run.runner, "time_study", _nothing)
        patch.setattr(dikbench.report.write, "write_report", _nothing)
        patch.setattr(dikbench.report.write, "write_times", _nothing)
        patch.setattr(sys, "argv", ["dikbench", *arguments])
        patch.chdir(folder)
        with pytest.raises(SystemExit) as left:
            cli.main()
        assert not list(Path(folder).iterdir())
    printed = capsys.readouterr()
    assert left.value.code in {None, 0, 2}
    assert "Traceback" not in printed.err
    if left.value.code == 2 and printed.err:
        assert len(printed.err.splitlines()) == 1, printed.err


def _nothing(*arguments: Any) -> str:
    return ""
