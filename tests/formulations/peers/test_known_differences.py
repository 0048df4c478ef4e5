"""Where the real libraries answer differently than ours, and why: a test for each difference."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from makers.peers import DT, asked, peer, states_of
from makers.problems import kinematics_at, problem_at, solve_for, velocity_of

from dikbench import load_robot
from dikbench.arrays import Array
from dikbench.errors import Infeasible, SolverFailed
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.problem import DikProblem, LinearizedTask, PoseTask, PostureTask
from dikbench.run.timing import record_run
from formulations.lu_kernel import lu_kernel
from formulations.peers.models import in_body_axes

EXACT = "daqp[preset=high]"
OUTSIDE_RAD = 0.05


def velocity(formulation: Any, problem: DikProblem) -> Array:
    """Ask a formulation."""
    return velocity_of(formulation, problem, EXACT)


def outside() -> DikProblem:
    """A Panda whose fourth joint is outside its upper limit, asked to rest."""
    robot = load_robot("panda")
    assert robot.limits.position is not None
    q = robot.q0.copy()
    q[3] = robot.limits.position.upper[3] + OUTSIDE_RAD
    return asked(robot, q, np.zeros(7), np.zeros(6))


def speed_share(problem: DikProblem, v: Array) -> float:
    """The largest speed over its limit."""
    limit = problem.robot.limits.velocity
    assert limit is not None
    return float((np.abs(v) / limit.upper).max())


# --- Pink


def test_pink_without_feed_forward_is_its_own_frame_task() -> None:
    """What is given in place of Pink's error is that error, where the target is at rest."""
    theirs = peer("peer-pink")
    import pink

    robot = load_robot("panda")
    for q, before, V in states_of(robot, 20):
        kinematics = kinematics_at(robot, q)
        target = kinematics.placement(robot.frame_id) * pin.exp6(pin.Motion(V))
        frame = pink.tasks.FrameTask(robot.frame, 1.0, 1.0, gain=10.0 * DT)
        frame.set_target(target)
        posture = pink.tasks.PostureTask(1e-2, gain=DT)
        posture.set_target(robot.q0)
        configuration = pink.Configuration(pin.Model(robot.model), robot.model.createData(), q)
        expected = pink.solve_ik(configuration, [frame, posture], DT, solver="daqp")
        tasks: list[LinearizedTask] = [
            PoseTask(target=target, gain=10.0).linearize(kinematics),
            PostureTask(robot.q0, gain=1.0, weight=1e-4).linearize(kinematics),
        ]
        v = velocity(theirs, problem_at(robot, q, tasks, before, DT))
        assert v == pytest.approx(expected, abs=1e-9)


def test_pink_refuses_outside_its_limits_where_ours_leads_back() -> None:
    """Its safety break; where that is off, position and velocity limits contradict each other."""
    problem = outside()
    with pytest.raises(Infeasible, match="Pink"):
        velocity(peer("peer-pink"), problem)
    assert velocity("pink-qp", problem)[3] < 0
    assert "refuses" in peer("peer-pink").known_difference(problem, None)


def test_pink_has_no_solution_where_its_limits_contradict_each_other() -> None:
    """A joint too fast to brake: ours gives up an acceleration bound, Pink the answer."""
    theirs = peer("peer-pink[limits=ours]")
    robot = load_robot("panda")
    robot = robot.with_limits(acceleration=robot.available_acceleration)
    none = 0
    for q, before, V in states_of(robot, 110):
        problem = asked(robot, q, before, V)
        expected = velocity("pink-qp", problem)
        if not problem.relaxed:
            continue
        none += 1
        assert np.isfinite(expected).all()
        assert "contradict" in theirs.known_difference(problem, None)
        with pytest.raises(SolverFailed):
            velocity(theirs, problem)
    assert none == 9  # as many as in the stored answers


def test_pinks_own_solver_passes_bounds_by_a_tolerance_of_displacements() -> None:
    """Daqp's 1e-6 is one of Delta q: 1e-4 rad/s at dt = 0.01; the same program in v is ours.

    On one of 480 steps past a singular wrist.
    """
    scenario = make_scenario("near-miss[robot=ur5,singularity=wrist,miss=0.05,speed=0.5]")
    own, told = peer("peer-pink[limits=ours]"), peer("peer-pink[limits=ours,solver=ours]")
    run = record_run(scenario, make_formulation("pink-qp"), solve_for(told))
    differing = 0
    for problem, expected in run[100:200]:
        assert expected is not None
        v = velocity(own, problem)
        assert velocity(told, problem) == pytest.approx(expected, abs=1e-9)
        if np.abs(v - expected).max() < 1e-6:
            continue
        differing += 1
        assert 1 + 1e-5 < speed_share(problem, v) < 1 + 1e-4 / 3
        assert "displacements" in own.known_difference(problem, v)
        assert own.known_difference(problem, expected) == ""
    assert differing == 1


# --- mink


def test_mink_has_no_velocity_limits_of_its_own() -> None:
    """Its answers are many times faster than the arm; told of the limits it keeps them."""
    robot = load_robot("panda")
    own, told = peer("peer-mink"), peer("peer-mink[limits=ours]")
    problems = [asked(robot, *state) for state in states_of(robot, 40)]
    assert max(speed_share(each, velocity(own, each)) for each in problems) > 5
    assert max(speed_share(each, velocity(told, each)) for each in problems) < 1 + 1e-6


def test_mink_drops_the_coupling_of_its_log_jacobian_at_small_angles() -> None:
    """Targets that are moved and not turned, or by less than 1e-5 rad; not by twice as much.

    With the identity in place of the derivative ours gives mink's velocity.
    """
    theirs, robot = peer("peer-mink[limits=ours]"), load_robot("panda")
    kinematics = kinematics_at(robot, robot.q0)
    X = kinematics.placement(robot.frame_id).copy()
    step = np.array([0.1, -0.2, 0.3])
    differences = {}
    for angle in (0.0, 5e-6, 2e-5):
        target = X * pin.SE3(pin.exp3(np.array([0.0, angle, 0.0])), step)
        task = PoseTask(target=target, gain=20.0).linearize(kinematics)
        problem = problem_at(robot, robot.q0, [task], np.zeros(7), DT)
        v, expected = velocity(theirs, problem), velocity("mink-qp", problem)
        assert speed_share(problem, v) == pytest.approx(1.0)  # saturated: else it does not matter
        differences[angle] = np.abs(v - expected).max()
        assert bool(theirs.known_difference(problem, None)) == (angle < 1e-5)
    assert differences[0.0] > 0.01
    assert differences[5e-6] > 0.01
    assert differences[2e-5] < 1e-4


def test_mink_returns_from_outside_at_once_if_it_can() -> None:
    """95 % of the way in one step, at any speed; ours at a tenth of the velocity limit."""
    problem = outside()
    v = velocity(peer("peer-mink"), problem)
    assert v[3] <= -0.95 * OUTSIDE_RAD / DT + 1e-6
    assert speed_share(problem, v) > 2
    assert speed_share(problem, velocity("mink-qp", problem)) < 1
    with pytest.raises(SolverFailed):  # and not where its limits contradict each other
        velocity(peer("peer-mink[limits=ours]"), problem)


# --- Drake


def test_drake_has_no_limits_of_its_own() -> None:
    """Whatever is asked for is done, at any speed."""
    robot = load_robot("panda")
    for state in states_of(robot, 20):
        problem = asked(robot, *state)
        v = velocity(peer("peer-drake"), problem)
        assert problem.primary.J @ v == pytest.approx(problem.primary.V, abs=1e-6)


def test_drake_finds_nothing_far_outside_its_limits() -> None:
    """One step cannot bring it back within the velocity limits; ours leads back."""
    robot, q = load_robot("panda"), outside().q
    back = -0.5 * kinematics_at(robot, q).task_jacobian()[:, 3]
    problem = asked(robot, q, np.zeros(7), back)
    with pytest.raises(SolverFailed, match="kNoSolutionFound"):
        velocity(peer("peer-drake[limits=ours]"), problem)
    assert velocity("drake", problem)[3] < 0


def test_drakes_osqp_stops_early_where_its_function_differs() -> None:
    """Three of 330 states of arms of seven joints: its answer costs more, or breaks J v = alpha V.

    In the program that Drake writes down.
    """
    differing = 0
    for name, centering in (("panda", 0.0), ("xarm7", 0.0), ("xarm7", 1.0)):
        theirs, robot = peer(f"peer-drake[limits=ours,centering={centering}]"), load_robot(name)
        for q, before, V in states_of(robot, 110):
            problem = asked(robot, q, before, V)
            v, expected = velocity(theirs, problem), velocity(theirs.counterpart, problem)
            if np.abs(v - expected).max() < 1e-6:
                continue
            differing += 1
            assert "OSQP" in theirs.known_difference(problem, v)
            assert theirs.known_difference(problem, 0.5 * expected) == ""
            J, wanted = problem.primary.J, problem.primary.V
            kernel = lu_kernel(np.roll(J, 3, axis=0))
            pull = centering * problem.tasks[1].error

            def cost(
                u: Array, J: Array = J, wanted: Array = wanted, kernel: Array = kernel,
                pull: Array = pull,
            ) -> float:  # fmt: skip
                alpha = (J @ u) @ wanted / (wanted @ wanted)
                penalty = kernel.T @ (u - pull)
                return float(-100 * alpha + penalty @ penalty)

            alpha = (J @ v) @ wanted / (wanted @ wanted)
            broken = np.abs(J @ v - alpha * wanted).max() > 1e-6 or speed_share(problem, v) > 1
            assert broken or cost(v) > cost(expected)
    assert 0 < differing <= 5


@pytest.mark.parametrize("name", ["panda", "ur5", "xarm7"])
def test_drakes_system_stops_early(name: str) -> None:
    """Wherever it differs by more than 1e-6 rad/s its answer costs more, in its own cost.

    That is at half of all states: OSQP's default tolerance, without polishing where no bound is
    active.
    """
    theirs, robot = peer("peer-drake-system[limits=ours]"), load_robot(name)
    differing = 0
    for state in states_of(robot, 60):
        problem = asked(robot, *state)
        v, expected = velocity(theirs, problem), velocity(theirs.counterpart, problem)
        if np.abs(v - expected).max() < 1e-6:
            continue
        differing += 1
        assert system_cost(problem, expected) < system_cost(problem, v)
        assert "OSQP" in theirs.known_difference(problem, v)
        # Answers to other problems are not explained so: one of half the speed, one of none.
        for other in (0.5 * expected, 0 * expected, -v):
            assert theirs.known_difference(problem, other) == ""
    assert 10 < differing < 50


def system_cost(problem: DikProblem, v: Array) -> float:
    """The cost that Drake writes down, of weight 100 and gain 1, with its kernel (world axes)."""
    J, V = problem.primary.J, problem.primary.V
    X = kinematics_at(problem.robot, problem.q).placement(problem.robot.frame_id)
    kernel = lu_kernel(np.roll(in_body_axes(X.rotation.T, J), 3, axis=0))
    penalty = kernel.T @ (v - problem.tasks[1].error) if kernel.size else np.zeros(1)
    return 100 * float((J @ v - V) @ (J @ v - V)) + float(penalty @ penalty)


# --- EmbodiK


def test_embodik_scales_before_it_has_used_all_joints() -> None:
    """Of arms with a joint to spare that are asked for too much: its scale is never above ours."""
    theirs, robot = peer("peer-embodik[limits=ours,damping=ours]"), load_robot("panda")
    differing = 0
    for state in states_of(robot, 60):
        problem = asked(robot, *state, posture=False)
        v, expected = velocity(theirs, problem), velocity("sns", problem)
        if np.abs(v - expected).max() < 1e-6:
            continue
        differing += 1
        J, V = problem.primary.J, problem.primary.V
        ours, its = (float((J @ u) @ V / (V @ V)) for u in (expected, v))
        least, box = np.linalg.pinv(J) @ V, problem.box("one-step")
        assert its <= ours + 1e-9
        assert ((least > box.upper) | (least < box.lower)).any()  # joints have to be held
        assert theirs.known_difference(problem, v).startswith("EmbodiK scales")
        assert theirs.known_difference(problem, expected) == ""
    assert differing > 5


def test_embodik_leaves_the_task_where_no_scale_fits() -> None:
    """A joint at its limit that the motion would pass: ours stands still, its fallback does not."""
    robot = load_robot("ur5")
    assert robot.limits.position is not None
    q = robot.q0.copy()
    q[1] = robot.limits.position.upper[1]
    V = kinematics_at(robot, q).task_jacobian() @ np.array([0.1, 0.2, 0.0, -0.1, 0.3, 0.1])
    problem = asked(robot, q, np.zeros(6), V, posture=False)
    assert velocity("sns", problem) == pytest.approx(np.zeros(6), abs=1e-9)
    v = velocity(peer("peer-embodik[limits=ours,damping=ours]"), problem)
    achieved = problem.primary.J @ v
    assert np.linalg.norm(achieved) > 0.01
    assert achieved @ V < 0.999 * np.linalg.norm(achieved) * np.linalg.norm(V)
    assert "leaves it" in peer("peer-embodik[limits=ours,damping=ours]").known_difference(
        problem, v
    )


def test_embodik_damps_where_no_singularity_is_near() -> None:
    """Its default tolerance of 0.1 acts at a Panda's ordinary posture; without it ours is met."""
    robot = load_robot("panda")
    problem = asked(robot, robot.q0, np.zeros(7), np.full(6, 0.05), posture=False)
    expected = velocity("sns", problem)
    own = peer("peer-embodik")
    v = velocity(own, problem)
    assert np.abs(v - expected).max() > 1e-3
    assert own.known_difference(problem, v) == "EmbodiK damps singular values near 0.1"
    both = asked(robot, robot.q0, np.zeros(7), np.full(6, 0.05))
    assert own.known_difference(both, v).endswith("and is asked for the first task alone")
    told = velocity(peer("peer-embodik[damping=ours]"), problem)
    assert told == pytest.approx(expected, abs=1e-9)
