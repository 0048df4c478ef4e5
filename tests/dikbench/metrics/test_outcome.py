"""Outcomes against a recomputation from the trace by plain loops, and the order of reasons."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from dikbench.arrays import Array
from dikbench.metrics import Judgement, Outcome, Verdict, evaluate, judge, motion_of
from dikbench.plugins.building import make_formulation, make_plant, make_scenario
from dikbench.problem import DikProblem, Solve
from dikbench.scenario import CollisionConstraint, Scenario
from dikbench.scenario.witness import Feasible
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.status import Status
from dikbench.simulation.trace import Trace
from dikbench.solvers.checked_solve import make_solve

L = 0.2
SCENARIOS = (
    "near-miss[miss=0.02,dt=0.02]",
    "near-miss[miss=0,speed=0.25,dt=0.02]",
    "speed-sweep[laps=1,dt=0.02]",
    "speed-sweep[laps=1,speed=1.5,dt=0.02]",
    "step[dt=0.02]",
    "hold-still[dt=0.02]",
    "obstacle[robot=ur5,dt=0.02]",
)
AT_REST = SCENARIOS[4:6]


@dataclass
class Share:
    """A share of a law's velocity, in turns two of them."""

    law: str
    even: float = 1.0
    odd: float = 1.0
    step: int = 0

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """Return it."""
        self.step += 1
        share = self.even if self.step % 2 else self.odd
        return share * make_formulation(self.law).velocity(problem, solve)


@dataclass
class Gone:
    """Stands still for three steps, then answers with a velocity that no robot has, or with NaN."""

    velocity_is: float
    step: int = 0

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """Return it."""
        self.step += 1
        return np.full(problem.robot.nv, self.velocity_is if self.step > 3 else 0.0)


LAWS: dict[str, Callable[[], Share | Gone]] = {
    "idle": lambda: Share("pinv", 0.0, 0.0),
    "reckless": lambda: Share("pinv"),
    "scaled": lambda: Share("pinv[after=scale]"),
    "half": lambda: Share("pinv[after=scale]", 0.5, 0.5),
    "jittery": lambda: Share("pinv[after=scale]", 1.9, 0.1),
    "shaky": lambda: Share("pinv[after=scale]", 1.3, 0.7),
    "trembling": lambda: Share("pinv[after=scale]", 0.98, 0.9),
    "clipped": lambda: Share("pinv[after=clip]"),
    "diverging": lambda: Gone(1e9),
    "failing": lambda: Gone(np.nan),
}


@cache
def scenario_of(name: str) -> Scenario:
    """Built once."""
    return make_scenario(name)


def x_of(X: Any) -> Array:
    """The whole pose as a point."""
    return np.concatenate([X.translation, L / np.sqrt(2) * X.rotation.ravel()])


def segment_distance(point: Array, start: Array, end: Array) -> Any:
    """From a point to a segment, or to several."""
    way = end - start
    square = np.maximum((way * way).sum(axis=-1), 1e-300)
    share = np.clip(((point - start) * way).sum(axis=-1) / square, 0.0, 1.0)
    return np.linalg.norm(point - start - share[..., None] * way, axis=-1)


def shaking_steps(trace: Trace, scenario: Scenario) -> set[int]:
    """Find the steps in which a joint reverses five times in 0.2 s, each by 1 % of its limit."""
    found: set[int] = set()
    limit = scenario.robot.limits.velocity
    from scipy.signal import find_peaks  # takes a second, of each process that collects tests

    assert limit is not None
    speeds = np.vstack([scenario.v0, trace.applied]) / limit.upper
    for v in speeds.T:
        peaks = [find_peaks(sign * v, prominence=0.01)[0].tolist() for sign in (1, -1)]
        places = sorted([*peaks[0], *peaks[1]])
        for first, last in zip(places, places[4:], strict=False):
            if (last - first) * scenario.dt <= 0.2 + 1e-9:
                found |= set(range(first - 1, last))
    return found


def expected(trace: Trace, scenario: Scenario, status: Status, tolerance: float) -> Outcome:
    """The table of outcomes for a pose task without torques."""
    if status is not Status.OK:
        return Outcome.DIVERGED if status is Status.DIVERGED else Outcome.DID_NOT_RUN
    robot, dt = scenario.robot, trace.dt
    assert robot.limits.velocity is not None
    assert robot.limits.position is not None
    for constraint in scenario.constraints:
        assert isinstance(constraint, CollisionConstraint)
        if (constraint.distances(robot, trace.q) < constraint.margin - 1e-3).any():
            return Outcome.COLLIDED
    if (np.abs(trace.applied) > 1.001 * robot.limits.velocity.upper).any():
        return Outcome.LIMIT_BROKEN
    q, bounds = trace.q[:, robot.limits.q_index], robot.limits.position
    if (q > bounds.upper + 1e-3).any() or (q < bounds.lower - 1e-3).any():
        return Outcome.LIMIT_BROKEN
    data, x = robot.model.createData(), []
    for each in trace.q:
        pin.framesForwardKinematics(robot.model, data, each)
        x.append(x_of(data.oMf[robot.frame_id]))
    reference = scenario.reference
    there = min(float(trace.tau[-1]), reference.duration)
    away = float(np.linalg.norm(x[-1] - x_of(reference.placement(there))))
    if not reference.moving:
        target = x_of(reference.placement(0.0))
        distances = [float(np.linalg.norm(p - target)) for p in x]
        if distances[0] <= scenario.tolerance_m and max(distances) > tolerance:
            return Outcome.LEFT_PATH
        if away > tolerance:
            return Outcome.UNFINISHED
    else:
        count = min(max(4 * round(reference.duration / dt), 200), 8000)
        times = np.linspace(0, reference.duration, count + 1)
        S = np.array([x_of(reference.placement(float(t))) for t in times])
        arcs = np.append(0, np.cumsum([np.linalg.norm(b - a) for a, b in pairwise(S)]))
        contour = max(float(segment_distance(p, S[:-1], S[1:]).min()) for p in x)
        targets = [np.flatnonzero(times <= tau + 1e-9)[-1] for tau in trace.tau]
        if trace.mode == "path":
            targets = [count] * len(x)

        def covered(within: float) -> list[int]:
            found, s = [], -1
            for k, p in enumerate(x):
                before = x[max(k - 1, 0)]
                while s < targets[k] and segment_distance(S[s + 1], before, p) <= within:
                    s += 1
                found.append(max(s, 0))
            return found

        if trace.mode == "time" and scenario.feasible == "path":
            extent = max(float(np.linalg.norm(p - S[0])) for p in S)
            bound = min(10 * tolerance, extent / 4)
            done = arcs[covered(bound)[-1]] >= 0.99 * arcs[-1] - 1e-9
            good = away <= tolerance and contour <= bound and done
            if not good:
                return Outcome.NOT_RECOVERED
        else:
            if contour > tolerance:
                return Outcome.LEFT_PATH
            if trace.mode == "path" and trace.tau[-1] < reference.duration * (1 - 1e-9):
                return Outcome.UNFINISHED
            places = covered(tolerance)
            least = 0.90 if trace.mode == "time" else 0.99
            if arcs[places[-1]] < least * arcs[-1] - 1e-9:
                return Outcome.UNFINISHED
            end = int(np.flatnonzero(trace.tau <= reference.duration + dt / 2)[-1])
            late = times[targets[end]] - times[places[end]]
            if trace.mode == "time" and late > max(0.1, 0.05 * reference.duration) + 1e-9:
                return Outcome.LATE
    dv = np.diff(np.vstack([scenario.v0, trace.applied]), axis=0)
    known = robot.available_acceleration
    jump = dt * (robot.limits.velocity.upper / 0.1 if known is None else known)
    shaking, count = shaking_steps(trace, scenario), 0
    for k in range(trace.steps):
        found = False
        for joint, most in enumerate(np.broadcast_to(jump, dv.shape[1])):
            if abs(dv[k, joint]) > most:
                before = [i for i in range(k) if abs(dv[i, joint]) > most]
                back = bool(before) and dv[before[-1], joint] * dv[k, joint] < 0
                found |= back and k - before[-1] <= 2
        count += found or k in shaking
    if count >= 10 and count > 0.05 * trace.steps:
        return Outcome.CHATTERING
    by_way = reference.moving and trace.mode == "time" and scenario.feasible == "path"
    return Outcome.RECOVERED if by_way else Outcome.SUCCESS


MODES: list[tuple[str, ReferenceMode]] = [
    *((name, "time") for name in SCENARIOS),
    *((name, "path") for name in SCENARIOS[1::2] if name not in AT_REST),
]


@cache
def outcomes(name: str, mode: ReferenceMode) -> list[tuple[Judgement, Outcome, float, str]]:
    """Judge every law at two tolerances: judgement, what is expected, tolerance, law."""
    scenario, found = scenario_of(name), []
    for law, make in LAWS.items():
        run = simulate(scenario, make(), make_solve(None, None), make_plant("ideal"), mode)
        motion = motion_of(run.trace, scenario)
        judged = judge(motion, run.status)
        # What a row keeps decides the same without the trace.
        row = {**evaluate(motion), **judged.columns(scenario.tolerance_m), "reference": mode}
        for tolerance in (2e-3, 0.02):
            right = expected(run.trace, scenario, run.status, tolerance)
            found.append((judged, right, tolerance, law))
            found.append((Judgement.of_row(row), right, tolerance, f"row of {law}"))
    return found


@pytest.mark.parametrize(("name", "mode"), MODES)
def test_outcomes_are_those_of_an_independent_recomputation(name: str, mode: ReferenceMode) -> None:
    """Law by law, at two tolerances; the columns of a row say the same without the trace."""
    for judged, right, tolerance, law in outcomes(name, mode):
        assert judged.at(tolerance).outcome is right, law


def test_every_outcome_is_among_them() -> None:
    """The recomputation is of trials that end in every way; one outcome is of those not run."""
    recomputed = {right for name, mode in MODES for _, right, _, _ in outcomes(name, mode)}
    assert recomputed == set(Outcome) - {Outcome.DOES_NOT_SEE}


def judgement(**changed: Any) -> Judgement:
    """Of a motion by the clock without a fault, on a path of 0.4 m."""
    fine = Judgement(
        before=None,
        by_clock=True,
        has_path=True,
        feasible="time",
        off_path=Verdict(Outcome.LEFT_PATH, 5, 1e-3, "position"),
        end=Verdict(Outcome.UNFINISHED, 9, 1e-3, "distance"),
        done_99=1e-3,
        done_90=1e-3,
        in_time=1e-3,
        extent=0.4,
        chatter=None,
    )
    return replace(fine, **changed)


FAR = Verdict(Outcome.LEFT_PATH, 5, 0.04, "orientation")
JITTER = Verdict(Outcome.CHATTERING, 3, 0.2)


@pytest.mark.parametrize(
    ("changed", "outcome"),
    [
        ({}, Outcome.SUCCESS),
        ({"before": Verdict(Outcome.COLLIDED), "off_path": FAR}, Outcome.COLLIDED),
        ({"off_path": FAR, "done_90": 1.0, "chatter": JITTER}, Outcome.LEFT_PATH),
        ({"done_90": 0.1, "in_time": 0.1}, Outcome.UNFINISHED),
        ({"done_99": 0.1}, Outcome.SUCCESS),
        ({"done_99": 0.1, "by_clock": False}, Outcome.UNFINISHED),
        ({"in_time": 0.1, "chatter": JITTER}, Outcome.LATE),
        ({"in_time": 0.1, "by_clock": False}, Outcome.SUCCESS),
        ({"chatter": JITTER}, Outcome.CHATTERING),
        ({"has_path": False, "off_path": FAR, "done_90": np.nan}, Outcome.SUCCESS),
        ({"feasible": "path", "in_time": 0.1, "off_path": FAR}, Outcome.RECOVERED),
        ({"feasible": "path", "done_99": 0.06}, Outcome.NOT_RECOVERED),
        ({"feasible": "path", "off_path": FAR, "extent": 0.1}, Outcome.NOT_RECOVERED),
        ({"feasible": "path", "end": replace(FAR, figure=6e-3)}, Outcome.NOT_RECOVERED),
        ({"feasible": "path", "in_time": 0.1, "by_clock": False}, Outcome.SUCCESS),
    ],
)
def test_the_first_reason_counts(changed: dict[str, Any], outcome: Outcome) -> None:
    """In the order of the table; what is asked of the clock is not asked of paths that wait."""
    assert judgement(**changed).at(5e-3).outcome is outcome


@pytest.mark.parametrize("feasible", ["time", "path", "no", "unknown"])
@pytest.mark.parametrize("by_clock", [True, False])
def test_a_larger_tolerance_turns_no_success_into_failure(
    feasible: Feasible, by_clock: bool
) -> None:
    """Whatever the figures."""
    random = np.random.default_rng(0)
    for _ in range(200):
        off, end, *needed = random.choice([5e-4, 3e-3, 8e-3, 0.03, np.inf], 5).tolist()
        case = judgement(
            feasible=feasible,
            by_clock=by_clock,
            off_path=replace(FAR, figure=off),
            end=replace(FAR, figure=end),
            done_99=max(needed),
            done_90=min(needed),
            in_time=needed[2],
        )
        ladder = [case.at(t).outcome in {Outcome.SUCCESS, Outcome.RECOVERED} for t in LADDER]
        assert ladder == sorted(ladder)


LADDER = (5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1)
