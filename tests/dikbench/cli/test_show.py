"""What `dikbench show` and `dikbench list` print."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

from makers.commands import GANTRY, in_process, run_all
from makers.urdfs import SIX, write_arm

from dikbench.cli.listing import listing
from dikbench.metrics import METRICS, Outcome
from dikbench.plugins.finding import plugins
from dikbench.scenario.plant import REFERENCE_MODES
from dikbench.scenario.witness import Feasible

SHOWN = {
    "qp": "min_v",
    "near-miss[miss=0.05]": "required speed over limit",
    "near-miss": (
        "miss = 0.02: a number, 0 or 0.001 to 0.2 [m; rad]  (instances: 0.002 to 0.05, logarithmic)"
    ),
    "dls": "damping = 0.05: a number, finite and at least 0  (tuned: 0.001 to 0.3, logarithmic)",
    "dls[damping=0.2]": "damping = 0.2 (default: 0.05): a number, finite and at least 0",
    "osqp": "eps_abs",
    "osqp[eps_abs=1e-6]": "selected: eps_abs=1e-6",
    "ideal[delay=2]": "delay = 2 (default: 0): a whole number, 0 to 1000 [steps]",
    "saturating": "Clips each joint",
    "oracle": "the exact joint motion",
    "panda": "panda_hand_tcp",
    "direction_error_max_rad": "unit: rad",
    "quick": "[[cells]]",
    "csv": "file must be given: csv[file=...]",
    "csv[dt=0.02]": "file must be given: csv[dt=0.02,file=...]",
    "needs.py:Needs": "strength must be given: needs.py:Needs[strength=...]",
    "reach": "Its target is at rest: how to get to it is up to a formulation.",
    "near-miss[miss=0.1]": "feasible unknown: neither a motion is known nor a proof",
    "near-miss[miss=0.03]": "reference path: the reference moves on with the progress",
    "near-miss[miss=0.04]": "outcome left-path: farther from the path",
    "ur5": "wrist_3_joint (5): turns; position -6.283 to 6.283 rad; speed 3.2 rad/s; acceleration",
    "gantry.urdf": "rail (0): slides; position -1 to 2 m; speed 0.5 m/s; torque or force 30 N",
    "././gantry.urdf": "flap follows rail",
    "./gantry.urdf": "wheel (1): turns without end; position -inf to inf rad; speed 2 rad/s",
}


def test_show_prints_one_thing_in_full(tmp_path: Path) -> None:
    """`dikbench show` knows formulations, scenarios, solvers, robots, metrics and studies."""
    folders = run_all(tmp_path, [("show", name) for name in SHOWN])
    for folder, expected in zip(folders, SHOWN.values(), strict=True):
        assert (folder / "code").read_text() in {"0", "null"}, (folder / "stderr").read_text()
        assert expected in (folder / "stdout").read_text()


def test_the_frames_of_a_robot_are_shown_with_what_moves_them(tmp_path: Path) -> None:
    """Those of a tree, in the order of the file."""
    (tmp_path / "gantry.urdf").write_text(GANTRY)
    shown = in_process("show", str(tmp_path / "gantry.urdf"))
    assert shown.exit_code == 0
    (frames,) = [line for line in shown.output.splitlines() if "camera" in line]
    found = dict(re.findall(r"(\w+) \((\d)\)", frames))
    assert {k: found[k] for k in ("floor", "cart", "hand", "camera")} == {
        "floor": "0", "cart": "1", "hand": "2", "camera": "1",
    }  # fmt: skip


def test_a_robot_is_shown_with_what_a_family_can_be_given(tmp_path: Path) -> None:
    """Rows, locked joints and limits by hand, of a file and of the catalogue."""
    arm = write_arm(tmp_path, SIX)
    shown = in_process("show", f"{arm}[frame=tool,rows=xyz,lock=j2=0.5 j6,acceleration=7]").output
    assert "a robot from a URDF; task frame tool\n" in shown
    assert "asked for: rows=xyz; its 4 joints move xyzrxryrz\n" in shown
    assert "4 velocities" in shown
    assert "j1 (0): turns; position -3 to 3 rad; speed 2 rad/s; acceleration 7 rad/s^2" in shown
    assert "\n    j2 (" not in shown
    assert "acceleration limits (given by hand)" in shown
    assert "6 velocities" in in_process("show", "panda[lock=panda_joint1]").output


def test_every_word_of_a_verdict_is_explained() -> None:
    """What a scenario's trials may be called, wherever `show` is asked."""
    shown = in_process("show", "near-miss").output
    words = {"feasible": get_args(Feasible), "reference": REFERENCE_MODES, "outcome": Outcome}
    for of, each in words.items():
        for word in each:
            assert f"\n  {of} {word}: " in shown


def test_a_scenario_is_shown_with_its_certificate_and_its_picture(tmp_path: Path) -> None:
    """The claims, what the motion asks for, what a seed perturbs; and a figure of its kind."""
    begins = {"svg": b"<?xml", "png": bytes.fromhex("89504e470d0a1a0a"), "pdf": b"%PDF"}
    shown = ("show", "near-miss[robot=panda,miss=0.01]", "--figure")
    for ending, head in begins.items():
        done = in_process(*shown, str(tmp_path / f"picture.{ending}"))
        assert done.exit_code == 0, done.output
        for part in (
            "Certificate of near-miss[robot=panda,miss=0.01]:",
            "smallest singular value (m, rad): ",
            "margin to the position limits [rad]: ",
            "required speed over limit: up to ",
            "reach from the first joint [m]: ",
            "A seed perturbs: start by up to 0.1 rad per joint, timing by up to 10 %.",
            f"picture.{ending}",
        ):
            assert part in done.stdout
        content = (tmp_path / f"picture.{ending}").read_bytes()
        assert content.startswith(head)
        assert len(content) > 5000


def test_every_listed_scenario_says_what_it_provokes_and_which_metric_shows_it() -> None:
    """One line each, and the metrics are there."""
    for family in plugins("scenario").values():
        assert family.paragraph("Provokes"), family.name
        shown = [name.strip() for name in family.paragraph("Shows in").split(",")]
        assert shown
        assert set(shown) <= set(METRICS), family.name
    lines = listing("scenarios")
    assert len(lines) == len(plugins("scenario"))
    assert any("near a singularity" in line and "velocity_peak_ratio" in line for line in lines)
