"""Alpha scaling against Drake and PlaCo, on states that they answered themselves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from makers.problems import with_limits_in_force

from dikbench import DikAnswer, Robot, Status, solve_dik

PEERS = Path(__file__).parents[2] / "data" / "peers"
LAW = "lp-alpha[regularization=0,braking=one-step]"


def load(name: str) -> list[dict[str, Any]]:
    """The records of one file of the peers' answers."""
    records: list[dict[str, Any]] = json.loads((PEERS / name).read_text())
    return records


CASES = {case["id"]: case for case in load("cases.json")}
DRAKE = load("drake_dik.json")
PLACO = load("placo_dik.json")


def answer(case: str, robot: Robot, solver: str) -> DikAnswer:
    """Our answer to a case, with the limits of the given robot."""
    q, V = CASES[case]["q"], CASES[case]["V"]
    return solve_dik(
        robot,
        q,
        formulation=LAW,
        twist=V,
        reference_frame="LOCAL_WORLD_ALIGNED",
        dt=0.01,
        solver=solver,
    )


def limited(case: str, in_force: str) -> Robot:
    """The robot of a case with position limits (q), velocity limits (v), both or none in force."""
    return with_limits_in_force(CASES[case]["robot"], in_force)


def drake_limits(record: dict[str, Any]) -> str:
    """The limits that were in force in Drake's run, as letters."""
    return "" if record["limits"] == "none" else str(record["limits"])


def label(record: dict[str, Any]) -> str:
    """What to call a case in a test's name."""
    return "-".join(str(record[key]) for key in ("id", "limits", "vel_limits") if key in record)


@pytest.mark.parametrize("solver", ["clarabel", "daqp", "highs", "piqp"])
@pytest.mark.parametrize("record", [r for r in PLACO if r["status"] == "ok"], ids=label)
def test_alpha_is_placos_scale(record: dict[str, Any], solver: str) -> None:
    """PlaCo's scaled priority goes as far as our LP; its position limits are always in force."""
    robot = limited(record["id"], "qv" if record["vel_limits"] else "q")
    ours = answer(record["id"], robot, solver)
    assert ours.progress == pytest.approx(record["scale"], abs=1e-6)


@pytest.mark.parametrize("solver", ["clarabel", "daqp", "highs", "piqp"])
@pytest.mark.parametrize("record", [r for r in DRAKE if r["status"] == "kSolutionFound"], ids=label)
def test_alpha_is_drakes(record: dict[str, Any], solver: str) -> None:
    """Where Drake found a solution, its alpha is our LP's, whichever limits were in force."""
    ours = answer(record["id"], limited(record["id"], drake_limits(record)), solver)
    assert ours.status is Status.OK
    assert ours.progress == pytest.approx(record["alpha"], abs=1e-6)


@pytest.mark.parametrize(
    "record",
    [r for r in DRAKE if r["status"] == "kSolutionFound" and r["id"].startswith("ur5")],
    ids=label,
)
def test_velocity_is_drakes_on_six_joints(record: dict[str, Any]) -> None:
    """Without a null space the velocity is unique: ours is Drake's."""
    ours = answer(record["id"], limited(record["id"], drake_limits(record)), "daqp")
    np.testing.assert_allclose(ours.velocity, record["v"], rtol=0, atol=1e-5)


@pytest.mark.parametrize("record", [r for r in DRAKE if r["status"] == "kStuck"], ids=label)
def test_stuck_where_drake_is_stuck(record: dict[str, Any]) -> None:
    """Where Drake reports that it is stuck we do, and stand still to 1e-6 of the motion."""
    ours = answer(record["id"], limited(record["id"], drake_limits(record)), "clarabel")
    assert ours.status is Status.STUCK
    assert abs(ours.progress) < 1e-6


def test_peers_have_no_answer_outside_a_limit() -> None:
    """Drake and PlaCo have no answer from outside a limit: there is nothing to compare with."""
    assert [r["id"] for r in DRAKE if r["status"] == "kNoSolutionFound"] == ["panda_outside_limit"]
    assert {r["id"] for r in PLACO if r["status"] != "ok"} == {"panda_outside_limit"}


@pytest.mark.parametrize(
    ("in_force", "sign", "status"),
    [
        ("qv", 1, Status.OK),  # the wanted motion leads back inside
        ("qv", -1, Status.INFEASIBLE),  # it leads further out: the fallback answers
        ("q", 1, Status.INFEASIBLE),  # all the way back in one step is not on any course
    ],
)
def test_ours_goes_back_inside(in_force: str, sign: int, status: Status) -> None:
    """From outside a limit ours goes back: at a tenth of the velocity limit, or in one step."""
    case = CASES["panda_outside_limit"]
    robot = limited(case["id"], in_force)
    ours = solve_dik(
        robot,
        case["q"],
        formulation=LAW,
        twist=sign * np.array(case["V"]),
        reference_frame="LOCAL_WORLD_ALIGNED",
        dt=0.01,
    )
    assert ours.status is status
    joint, overshoot = 3, -3.0718 - case["q"][3]  # q4 is below its lower limit
    speed = overshoot / 0.01 if robot.limits.velocity is None else 0.1 * 2.175
    assert overshoot == pytest.approx(0.05)
    assert ours.velocity[joint] >= speed - 1e-6
