"""Every family on every robot: what it claims holds, and its parts fit together."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import CLOSED, scenario_of

from dikbench.arrays import Array
from dikbench.plugins.building import make_scenario
from dikbench.plugins.finding import plugins
from dikbench.problem.tasks import PostureTask
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.scenario import Scenario
from dikbench.scenario.family import certified_robots
from dikbench.scenario.plant import Ideal
from dikbench.simulation.closed_loop import simulate
from dikbench.solvers.checked_solve import make_solve
from formulations.pseudo_inverse import PseudoInverse
from scenarios import SCENARIOS
from scenarios.joint_limit_crossing import CROSSINGS
from scenarios.obstacle import SWINGS
from scenarios.singular_postures import SINGULAR_POSTURES

# What a robot needs beside its name, and variants that are cases of their own.
EXTRA = {
    **{
        ("near-miss", robot): [f"singularity={name}" for name in postures]
        for robot, postures in SINGULAR_POSTURES.items()
    },
    ("near-miss", "ur5"): ["", "miss=0", "miss=0.005", "miss=0.2,speed=0.1"],
    ("joint-limit-crossing", "panda"): ["", "acceleration=true"],
    ("speed-sweep", "panda"): ["speed=0.3", "speed=1.3", "speed=2"],
    ("obstacle", "panda"): [
        f"where={where},shape={shape}" for where in SWINGS for shape in ("sphere", "capsule", "box")
    ],
    ("obstacle", "xarm7"): ["", "where=elbow"],
    ("obstacle", "lwr"): ["where=elbow"],
}
SEEDS = (1, 2, 3, 4, 5)
FEW = (0, 1)


HELD = {"hold-still", "log-derivative-drift"}
"""Families whose target at rest is where the robot starts."""

OTHER_TASKS = {"task-conflict", "start-outside", "humanoid"}
"""Families with another second task than to hold the start's posture."""

SELECTORS = [
    f"{name}[robot={robot}{',' if extra else ''}{extra}]"
    for name, family in SCENARIOS.items()
    if name in CLOSED
    for robot in certified_robots(family)
    for extra in EXTRA.get((name, robot), [""])
]
FIRST = {next(s for s in SELECTORS if s.startswith(f"{name}[")) for name in CLOSED}
"""Of each family, the selector with the robot that it is made for."""


IN_TURNS = [
    pytest.param(
        selector,
        seed,
        marks=()
        if (k % 2 == 0 and seed == k // 2 % (len(SEEDS) + 1)) or (selector in FIRST and seed in FEW)
        else pytest.mark.long,
    )
    for k, selector in enumerate(SELECTORS)
    for seed in (0, *SEEDS)
]
"""Every selector with every seed; the normal run has one seed of every second one, in turns.

The first selector of a family has a few of them there too.
"""

ONCE_A_FAMILY = [
    pytest.param(selector, marks=() if selector in FIRST else pytest.mark.long)
    for selector in SELECTORS
]
"""Every selector; the normal run has the first one of each family."""


def _placement(robot: Robot, q: Array) -> pin.SE3:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics.placement(robot.frame_id).copy()


def _distance(a: pin.SE3, b: pin.SE3) -> float:
    """Norm of the body twist (m, rad) from one placement to another."""
    return float(np.linalg.norm(pin.log6(a.actInv(b)).np))


def _margin(robot: Robot, q: Array) -> float:
    seen = robot.limits.at(q)
    assert seen.to_lower is not None
    assert seen.to_upper is not None
    return float(min(seen.to_lower.min(), seen.to_upper.min()))


# --- every family, robot and seed


@pytest.mark.parametrize(("selector", "seed"), IN_TURNS)
def test_scenarios_hold_what_they_claim_and_fit_together(selector: str, seed: int) -> None:
    """The certificate holds, and the start is inside the limits, on the path, and as fast as it."""
    scenario = scenario_of(selector, seed)
    assert len(scenario.certificate.claims) >= 2
    assert all(claim.holds for claim in scenario.certificate.claims)
    robot, reference = scenario.robot, scenario.reference
    assert scenario.q0.shape == (robot.nq,)
    assert scenario.v0.shape == (robot.nv,)
    family = selector.partition("[")[0]
    if family == "start-outside":
        assert -1.01e-2 < _margin(robot, scenario.q0) < 0
    else:
        assert _margin(robot, scenario.q0) > 0.02
    velocity = robot.limits.velocity
    assert velocity is not None
    assert np.all(scenario.v0 <= velocity.upper * (1 + 1e-9))
    assert np.all(scenario.v0 >= velocity.lower * (1 + 1e-9))
    if not reference.moving:
        assert np.all(scenario.v0 == 0)
        if family not in HELD:
            assert _distance(_placement(robot, scenario.q0), reference.placement(0.0)) > 0.01
        return
    X_d, V_d = reference.placement(0.0), pin.Motion(reference.velocity(0.0))
    kinematics = Kinematics(robot)
    kinematics.update(scenario.q0)
    start = scenario.tracking.linearize(kinematics, X_d, V_d)
    assert np.abs(start.error).max() < 1e-8
    # The start moves as the reference does; slower where that is too fast, never elsewhere.
    made, wanted = start.J @ scenario.v0, start.V
    size = float(wanted @ wanted)
    share = float(made @ wanted) / size if size > 1e-12 else 1.0
    assert made == pytest.approx(share * wanted, abs=1e-6)
    assert 0 < share <= 1 + 1e-9
    if share < 1 - 1e-9:
        assert velocity.usage(scenario.v0).max() == pytest.approx(1.0)


@pytest.mark.parametrize(("selector", "seed"), IN_TURNS)
def test_reference_velocity_is_the_derivative_of_its_placement(selector: str, seed: int) -> None:
    """The body twist of the path, by central differences, all along it (but for its own kink)."""
    reference = scenario_of(selector, seed).reference
    h = 1e-5 * reference.duration
    for share in (0.0, 0.07, 0.31, 0.49, 0.52, 0.83, 0.99):
        tau = share * reference.duration
        start = max(tau - h, 0.0)
        before, after = reference.placement(start), reference.placement(tau + h)
        twist = pin.log6(before.actInv(after)).np / (tau + h - start)
        middle = (start + tau + h) / 2
        assert twist == pytest.approx(reference.velocity(middle), abs=1e-6, rel=1e-6)


def _samples(scenario: Scenario) -> list[Array]:
    reference = scenario.reference
    return [
        reference.placement(share * reference.duration).homogeneous.copy()
        for share in (0.0, 0.4, 1.0)
    ]


@pytest.mark.parametrize("selector", ONCE_A_FAMILY)
def test_the_same_seed_is_the_same_scenario(selector: str) -> None:
    """To the bit: start, velocity, path, duration and certificate."""
    a, b = scenario_of(selector, 1), make_scenario(selector, 1)
    assert np.array_equal(a.q0, b.q0)
    assert np.array_equal(a.v0, b.v0)
    assert np.array_equal(_samples(a), _samples(b))
    assert (a.duration, a.dt, a.tracking.gain) == (b.duration, b.dt, b.tracking.gain)
    assert a.certificate == b.certificate


@pytest.mark.parametrize(
    "seeds", [FEW, pytest.param((0, *SEEDS), marks=pytest.mark.long)], ids=["few", "many"]
)
@pytest.mark.parametrize("selector", ONCE_A_FAMILY)
def test_every_seed_is_another_scenario(selector: str, seeds: tuple[int, ...]) -> None:
    """Start and path differ between any two of them, by no more than a perturbation."""
    scenarios = [scenario_of(selector, seed) for seed in seeds]
    for i, a in enumerate(scenarios):
        for b in scenarios[:i]:
            assert np.abs(a.q0 - b.q0).max() > 1e-4
            assert np.abs(np.array(_samples(a)) - np.array(_samples(b))).max() > 1e-4
    for perturbed in scenarios[1:]:
        assert np.abs(perturbed.q0 - scenarios[0].q0).max() < 0.6


@pytest.mark.parametrize("robot", certified_robots(SCENARIOS["reach"]))
def test_seed_zero_of_reach_starts_at_the_robots_start(robot: str) -> None:
    """Nothing is perturbed; another seed moves every joint by at most 0.1 rad."""
    start = load_robot(robot).q0
    assert np.array_equal(make_scenario(f"reach[robot={robot}]").q0, start)
    moved = make_scenario(f"reach[robot={robot}]", 1).q0
    assert 0 < np.abs(moved - start).max() <= 0.1


def test_seed_zero_of_the_speed_sweep_starts_at_the_robots_start() -> None:
    """Nothing is perturbed."""
    assert np.array_equal(make_scenario("speed-sweep").q0, load_robot("panda").q0)


@pytest.mark.parametrize("robot", CROSSINGS)
def test_seed_zero_of_a_limit_crossing_has_the_tables_posture(robot: str) -> None:
    """But for the joint that crosses, which a seed leaves alone too."""
    where = CROSSINGS[robot]
    scenario = make_scenario(f"joint-limit-crossing[robot={robot},approach=0.25]")
    others = np.delete(np.arange(scenario.robot.nv), where.joint)
    assert np.array_equal(scenario.q0[others], np.array(where.posture)[others])
    position = scenario.robot.limits.position
    assert position is not None
    for seed in (0, 1):
        q0 = make_scenario(f"joint-limit-crossing[robot={robot},approach=0.25]", seed).q0
        assert position.upper[where.joint] - q0[where.joint] == pytest.approx(0.25)


# --- what makes each family what it is


@pytest.mark.parametrize("speed", [0.3, 1.0, 1.3])
def test_the_speed_sweep_peaks_at_its_speed(speed: float) -> None:
    """Following it exactly, a law without limits moves at that share of the velocity limits."""
    scenario = make_scenario(f"speed-sweep[speed={speed},dt=0.002,laps=1]")
    run = simulate(scenario, PseudoInverse(), make_solve(None, None), Ideal())
    velocity = scenario.robot.limits.velocity
    assert velocity is not None
    assert velocity.usage(run.trace.applied).max() == pytest.approx(speed, rel=0.05)


def test_the_speed_sweep_is_a_circle() -> None:
    """In the y-z plane, of the radius asked for, through the start, orientation fixed."""
    scenario = make_scenario("speed-sweep[radius=0.07,laps=2]")
    reference = scenario.reference
    start = reference.placement(0.0)
    centre = start.translation + np.array([0, 0, 0.07])
    for share in np.linspace(0, 1, 9):
        X = reference.placement(share * reference.duration)
        assert np.linalg.norm(X.translation - centre) == pytest.approx(0.07)
        assert X.translation[0] == pytest.approx(start.translation[0])
        assert np.array_equal(X.rotation, start.rotation)
    lap = reference.placement(reference.duration / 2)
    assert _distance(start, lap) < 1e-9


@pytest.mark.parametrize("robot", CROSSINGS)
def test_a_limit_crossing_asks_for_its_depth_and_comes_back(robot: str) -> None:
    """Half way the joint would be `depth` beyond its limit; at the end the path is at its start."""
    scenario = make_scenario(f"joint-limit-crossing[robot={robot},depth=0.15]")
    reference, joint = scenario.reference, CROSSINGS[robot].joint
    beyond = scenario.q0.copy()
    position = scenario.robot.limits.position
    assert position is not None
    beyond[joint] = position.upper[joint] + 0.15
    middle = reference.placement(reference.duration / 2)
    assert _distance(_placement(scenario.robot, beyond), middle) < 1e-9
    assert _distance(reference.placement(0.0), reference.placement(reference.duration)) < 1e-9


@pytest.mark.parametrize("robot", CROSSINGS)
def test_a_limit_crossing_peaks_at_its_speed(robot: str) -> None:
    """The joint moves at the given share of its own velocity limit, at most."""
    scenario = make_scenario(f"joint-limit-crossing[robot={robot},speed=0.4]")
    joint, reference = CROSSINGS[robot].joint, scenario.reference
    velocity = scenario.robot.limits.velocity
    assert velocity is not None
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.q0)
    # One joint turns the frame about its own axis: its rate is the angular speed.
    taus = np.linspace(0, reference.duration, 401)
    rates = [np.linalg.norm(reference.velocity(tau)[3:]) for tau in taus]
    assert max(rates) == pytest.approx(0.4 * velocity.upper[joint], rel=1e-3)


@pytest.mark.parametrize("robot", ["panda", "ur5"])
def test_the_target_of_reach_is_as_far_as_asked(robot: str) -> None:
    """`distance` and `angle` away along one body axis (a screw: the log's parts)."""
    for seed in (0, 1):
        scenario = make_scenario(f"reach[robot={robot},distance=0.08,angle=0.25]", seed)
        start = _placement(scenario.robot, scenario.q0)
        twist = pin.log6(start.actInv(scenario.reference.placement(0.0))).np
        assert np.linalg.norm(twist[:3]) == pytest.approx(0.08)
        assert np.linalg.norm(twist[3:]) == pytest.approx(0.25)
        assert twist[:3] / 0.08 == pytest.approx(twist[3:] / 0.25)


@pytest.mark.parametrize(
    "name", [n for n in CLOSED if not plugins("scenario")[n].parameters["acceleration"].hidden]
)
def test_acceleration_limits_are_in_force_only_where_asked_for(name: str) -> None:
    """And are the catalogue's then."""
    off, on = scenario_of(name), make_scenario(f"{name}[acceleration=true]")
    assert off.robot.limits.acceleration is None
    assert on.robot.limits.acceleration is not None
    assert on.robot.available_acceleration is not None
    assert np.array_equal(on.robot.limits.acceleration.upper, on.robot.available_acceleration)
    assert np.array_equal(on.robot.limits.acceleration.lower, -on.robot.limits.acceleration.upper)


@pytest.mark.parametrize(("selector", "seed"), IN_TURNS)
def test_redundant_arms_hold_a_posture_and_others_have_no_second_task(
    selector: str, seed: int
) -> None:
    """The posture of the start, below the tracking, weighted so that it is not seen there."""
    scenario = scenario_of(selector, seed)
    if selector.partition("[")[0] in OTHER_TASKS:
        return
    if scenario.robot.nv <= len(scenario.rows):
        assert scenario.tasks == ()
        return
    (task,) = scenario.tasks
    assert isinstance(task, PostureTask)
    assert np.array_equal(task.target, scenario.q0)
    assert task.priority > 1
    assert task.weight == pytest.approx(1e-4)
