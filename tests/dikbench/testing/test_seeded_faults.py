"""Faults that authors make, put into a sound formulation: `dikbench check` names each of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from makers.commands import in_process
from makers.few_states import few_states

HEAD = '''
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import threading

import numpy as np
import pinocchio as pin

from dikbench.problem import Drawn, Parameters, Range, damped_least_squares


@dataclass(frozen=True)
class Sound(Parameters):
    """Damped least squares inside the velocity limits.

    Source: a test.
    """

    damping: Annotated[float, Range(1e-3, 10.0)] = 0.05
    keeps: ClassVar[frozenset[str]] = frozenset({"velocity"})

    def velocity(self, problem, solve):
        return self.scaled(problem, self.free(problem))

    def free(self, problem):
        task = problem.primary
        return damped_least_squares(task.J, task.V, self.damping)

    def scaled(self, problem, v):
        limit = problem.limits.joint.velocity
        return v if limit is None else v / max(1.0, float(limit.usage(v).max()))


'''

STRICT = (
    "strict: ClassVar[bool] = True\n    sees: ClassVar[frozenset[str]] = frozenset({'lower-tasks'})"
)

STRIDE = 20
"""One state in so many is asked: eight, of every robot, at every speed, in and out of limits."""

FAULTS = {
    # 1. NaN
    "nan": (
        "finite",
        "v = Sound.velocity(self, problem, solve)\n"
        "        with np.errstate(invalid='ignore'):\n"
        "            return v / np.linalg.norm(v)",
    ),
    "infinity": (
        "finite",
        "v = Sound.velocity(self, problem, solve)\n"
        "        return v if problem.primary.V.any() else v + np.inf",
    ),
    "infinity in one joint": (
        "finite",
        "v = Sound.velocity(self, problem, solve); v[0] = v[0] if v.any() else -np.inf; return v",
    ),
    # 2. mutation
    "writes into q": (
        "inputs untouched",
        "problem.q += 1e-9; return Sound.velocity(self, problem, solve)",
    ),
    "replaces q": (
        "inputs untouched",
        "problem.q = problem.q + 1e-9; return Sound.velocity(self, problem, solve)",
    ),
    "writes into the Jacobian": (
        "inputs untouched",
        "problem.tasks[0].J *= 1 + 1e-12; return Sound.velocity(self, problem, solve)",
    ),
    "writes into the wanted twist": (
        "inputs untouched",
        "problem.primary.V *= 1 + 1e-9; return Sound.velocity(self, problem, solve)",
    ),
    "writes into the limits": (
        "inputs untouched",
        "problem.limits.joint.velocity.upper[0] *= 0.99\n"
        "        return Sound.velocity(self, problem, solve)",
    ),
    "writes into the model": (
        "inputs untouched",
        "problem.robot.model.velocityLimit[0] *= 0.99; return Sound.velocity(self, problem, solve)",
    ),
    "writes into the last velocity": (
        "inputs untouched",
        "v = Sound.velocity(self, problem, solve)\n"
        "        if problem.v_prev is not None:\n"
        "            problem.v_prev[:] = v\n"
        "        return v",
    ),
    # 3. a promised limit is ignored
    "velocity limits": ("velocity limits", "return self.free(problem)"),
    "velocity limits, of one joint": (
        "velocity limits",
        "v = Sound.velocity(self, problem, solve); v[-1] = self.free(problem)[-1]; return v",
    ),
    "velocity limits, a little": (
        "velocity limits",
        "return 1.0001 * Sound.velocity(self, problem, solve)",
    ),
    "position limits": (
        "position limits",
        "return Sound.velocity(self, problem, solve)",
        'keeps: ClassVar[frozenset[str]] = frozenset({"position"})',
    ),
    "acceleration limits": (
        "acceleration limits",
        "return Sound.velocity(self, problem, solve)",
        'keeps: ClassVar[frozenset[str]] = frozenset({"acceleration"})',
    ),
    "rows G v <= h": (
        "inequalities",
        "return Sound.velocity(self, problem, solve)",
        'keeps: ClassVar[frozenset[str]] = frozenset({"inequalities"})',
    ),
    # 4. state is kept
    "state in the object": (
        "memory",
        "v = Sound.velocity(self, problem, solve)\n"
        "        last = self.last.get(len(v), v)\n"
        "        self.last[len(v)] = v\n"
        "        return self.scaled(problem, 0.9 * v + 0.1 * last)",
        "last: dict = field(default_factory=dict, init=False, compare=False)",
    ),
    "state in the module": (
        "memory",
        "v = Sound.velocity(self, problem, solve)\n"
        "        last = LAST.get(len(v), v)\n"
        "        LAST[len(v)] = v\n"
        "        return self.scaled(problem, 0.9 * v + 0.1 * last)",
    ),
    "state in the class": (
        "memory",
        "v = Sound.velocity(self, problem, solve)\n"
        "        last = Faulty.last.get(len(v), v)\n"
        "        Faulty.last[len(v)] = v\n"
        "        return self.scaled(problem, 0.9 * v + 0.1 * last)",
        "last: ClassVar[dict] = {}",
    ),
    "state in a closure": (
        "memory",
        "return self.scaled(problem, FILTERED(Sound.velocity(self, problem, solve)))",
    ),
    "state in a default": (
        "memory",
        "return self.scaled(problem, filtered(Sound.velocity(self, problem, solve)))",
    ),
    "an array that is used again": (
        "memory",
        "v = BUFFER.setdefault(problem.robot.nv, np.zeros(problem.robot.nv))\n"
        "        v[:] = Sound.velocity(self, problem, solve)\n"
        "        return v",
    ),
    # 5. wrong frame
    "a twist in the world": (
        "direction",
        "pin.framesForwardKinematics(problem.robot.model, problem.robot.scratch, problem.q)\n"
        "        R = problem.robot.scratch.oMf[problem.robot.frame_id].rotation\n"
        "        return self.of(problem, in_frame(R.T, problem))",
    ),
    "a twist turned the wrong way": (
        "direction",
        "pin.framesForwardKinematics(problem.robot.model, problem.robot.scratch, problem.q)\n"
        "        R = problem.robot.scratch.oMf[problem.robot.frame_id].rotation\n"
        "        return self.of(problem, in_frame(R, problem))",
    ),
    "the parts of the twist exchanged": (
        "direction",
        "return self.of(problem, np.roll(problem.primary.V, 3))",
    ),
    "the sign of the error": ("direction", "return self.of(problem, -problem.primary.V)"),
    # 6. wrong shape
    "a column": ("shape", "return Sound.velocity(self, problem, solve)[:, None]"),
    "a row": ("shape", "return Sound.velocity(self, problem, solve)[None]"),
    "one too many": ("shape", "return np.append(Sound.velocity(self, problem, solve), 0.0)"),
    "a list": ("shape", "return Sound.velocity(self, problem, solve).tolist()"),
    "a number": ("shape", "return 0.0"),
    "nothing": ("shape", "return None"),
    "whole numbers": ("shape", "return np.zeros(problem.robot.nv, dtype=int)"),
    "single precision": ("shape", "return Sound.velocity(self, problem, solve).astype(np.float32)"),
    # 7. slow drift of answers
    "a drift with every call": (
        "memory",
        "CALLS.append(1); v = Sound.velocity(self, problem, solve)\n"
        "        return v * (1 - 1e-12 * len(CALLS))",
    ),
    "a drift in steps": (
        "memory",
        "CALLS.append(1); v = Sound.velocity(self, problem, solve)\n"
        "        return v * (1 - 1e-9 * (len(CALLS) // 20))",
    ),
    "a drift of a joint at rest": (
        "memory",
        "CALLS.append(1); v = self.scaled(problem, 0.99 * self.free(problem))\n"
        "        v[0] += 1e-15 * len(CALLS)\n"
        "        return v",
    ),
    # 8. not picklable
    "a lambda for a parameter": (
        "picklable",
        "return self.shape(Sound.velocity(self, problem, solve))",
        "shape: object = field(default=lambda v: v)",
    ),
    "a lock": (
        "picklable",
        "return Sound.velocity(self, problem, solve)",
        "lock: object = field(default_factory=threading.Lock, init=False, compare=False)",
    ),
    "a copy that is another one": (
        "picklable",
        "return Sound.velocity(self, problem, solve) * (1 - 1e-9 * (self.copied == 'yes'))",
        "copied: str = 'no'\n"
        "    def __reduce__(self):\n"
        "        return (Faulty, (self.damping, 'yes'))",
    ),
    # 9. parameters unchecked
    "a number without a range": (
        "ranges",
        "return self.share * Sound.velocity(self, problem, solve)",
        "share: float = 0.5",
    ),
    "an end of the range that gives no number": (
        "ranges",
        "v = Sound.velocity(self, problem, solve)\n        return v if self.share else v * np.nan",
        "share: Annotated[float, Range(0.0, 1.0)] = 0.5",
    ),
    "an end of the range at which it raises": (
        "ranges",
        "return Sound.velocity(self, problem, solve) * min(1.0, 1 / self.share)",
        "share: Annotated[float, Range(0.0, 1.0)] = 0.5",
    ),
    "an end of what is tuned at which it raises": (
        "ranges",
        "return Sound.velocity(self, problem, solve) / (1 if self.share < 0.9 else 0)",
        "share: Annotated[float, Range(0.0, 1.0), Drawn(0.1, 0.9)] = 0.5",
    ),
    "conditions that raise": (
        "ranges",
        "return Sound.velocity(self, problem, solve)",
        "share: Annotated[float, Range(0.0, 1.0)] = 0.5\n"
        "    def check(self):\n"
        "        1 / self.share",
    ),
    # 10. a priority leaks where strictness is promised
    "a posture that is not projected": (
        "priority",
        "v = self.free(problem)\n"
        "        for task in problem.tasks[1:]:\n"
        "            v = v + 1e-3 * task.J.T @ task.V\n"
        "        return self.scaled(problem, v)",
        STRICT,
    ),
    "a damped projector": (
        "priority",
        "v, J = self.free(problem), problem.primary.J\n"
        "        N = np.eye(len(v)) - J.T @ np.linalg.solve(J @ J.T + 1e-2 * np.eye(len(J)), J)\n"
        "        for task in problem.levels[1:]:\n"
        "            v = v + N @ (1e-2 * task.J.T @ task.V)\n"
        "        return self.scaled(problem, v)",
        STRICT,
    ),
    "weights in place of priorities": (
        "priority",
        "J = np.vstack([0.1 ** (task.priority - 1) * task.J for task in problem.levels])\n"
        "        V = np.concatenate([0.1 ** (t.priority - 1) * t.V for t in problem.levels])\n"
        "        return self.scaled(problem, damped_least_squares(J, V, self.damping))",
        STRICT,
    ),
    # 11. a warm start is misused
    "a descent that starts at the last answer": (
        "memory",
        "task = problem.primary\n"
        "        v = WARM.get(problem.robot.nv, np.zeros(problem.robot.nv))\n"
        "        for _ in range(5):\n"
        "            v = v - 0.1 * task.J.T @ (task.J @ v - task.V)\n"
        "        WARM[problem.robot.nv] = v\n"
        "        return self.scaled(problem, v)",
    ),
    "what is near is taken for the same": (
        "memory",
        "for q, V, v in NEAR:\n"
        "            task = problem.primary\n"
        "            if q.shape == problem.q.shape and V.shape == task.V.shape:\n"
        "                near = np.allclose(q, problem.q, atol=1e-3)\n"
        "                if near and np.allclose(V, task.V, rtol=1e-3):\n"
        "                    return v.copy()\n"
        "        v = Sound.velocity(self, problem, solve)\n"
        "        NEAR.append((problem.q.copy(), problem.primary.V.copy(), v.copy()))\n"
        "        return v",
    ),
    "the last answer where there is none": (
        "memory",
        "if not LAST.get('turn'):\n"
        "            LAST['turn'] = True\n"
        "            LAST[problem.robot.nv] = Sound.velocity(self, problem, solve)\n"
        "        else:\n"
        "            LAST['turn'] = problem.robot.nv not in LAST\n"
        "        return LAST.get(problem.robot.nv, np.zeros(problem.robot.nv)).copy()",
    ),
    # 12. an unsupported problem is answered
    "a second task of first priority": (
        "refusals",
        "task = problem.tasks[0]\n"
        "        return self.scaled(problem, damped_least_squares(task.J, task.V, self.damping))",
    ),
    "what it refuses": (
        "refusals",
        "return Sound.velocity(self, problem, solve)",
        "def refuses(self, problem):\n"
        '        return "six rows" if len(problem.primary.V) not in (6, 3) else ""',
    ),
    "rows that contradict each other": (
        "refusals",
        "v = Sound.velocity(self, problem, solve)\n"
        "        if problem.G is not None:\n"
        "            for _ in range(50):\n"
        "                for g, h in zip(problem.G, problem.h):\n"
        "                    v = v - g * max(0.0, g @ v - h) / (g @ g)\n"
        "        return v",
        'keeps: ClassVar[frozenset[str]] = frozenset({"inequalities"})',
    ),
    "a part of a pose, in words of Python": (
        "refusals",
        "task = problem.tasks[0]\n"
        "        if len(task.V) == 2:\n"
        "            raise IndexError('index 2 is out of bounds')\n"
        "        return Sound.velocity(self, problem, solve)",
    ),
    "a refusal that is no text": (
        "refusals",
        "return Sound.velocity(self, problem, solve)",
        "def refuses(self, problem):\n        return None",
    ),
    "lower tasks that are declared and not seen": (
        "sight",
        "return Sound.velocity(self, problem, solve)",
        'sees: ClassVar[frozenset[str]] = frozenset({"lower-tasks"})',
    ),
    "lower tasks that are seen and not declared": (
        "sight",
        "v = Sound.velocity(self, problem, solve)\n"
        "        v = v + 1e-3 * sum(t.J.T @ t.V for t in problem.tasks[1:])\n"
        "        return self.scaled(problem, v)",
    ),
}
"""The check that names a fault, the body of `velocity`, and what stands before it in the class."""

TAIL = """
LAST, BUFFER, CALLS, WARM, NEAR = {}, {}, [], {}, []


def in_frame(R, problem):
    V, rows = np.zeros(6), list(problem.robot.task_rows)
    V[rows] = problem.primary.V[: len(rows)]
    turned = np.concatenate([R @ V[:3], R @ V[3:]])
    return np.append(turned[rows], problem.primary.V[len(rows) :])


def make_filter():
    last = {}

    def filtered(v):
        before = last.get(len(v), v)
        last[len(v)] = v
        return 0.9 * v + 0.1 * before

    return filtered


FILTERED = make_filter()


def filtered(v, last={}):
    before = last.get(len(v), v)
    last[len(v)] = v
    return 0.9 * v + 0.1 * before
"""


def source_of(fault: str) -> str:
    """Write the file of a formulation with one fault."""
    _, body, *fields = FAULTS[fault]
    fields = fields or ["pass"]
    return (
        f"{HEAD}@dataclass(frozen=True)\nclass Faulty(Sound):\n    {fields[0]}\n\n"
        f"    def of(self, problem, V):\n"
        f"        task = problem.primary\n"
        f"        return self.scaled(problem, damped_least_squares(task.J, V, self.damping))\n\n"
        f"    def velocity(self, problem, solve):\n        {body}\n{TAIL}"
    )


@pytest.fixture(autouse=True)
def _some_states() -> Iterator[None]:
    """Ask at one state in so many, as the contract of the shipped ones is asked."""
    with few_states(1, STRIDE):
        yield


def broken(selector: str) -> dict[str, str]:
    """The checks that `dikbench check` calls broken, each with its line."""
    done = in_process("check", selector)
    lines = [line for line in done.output.splitlines() if line.startswith("BROKEN")]
    assert done.exit_code == (1 if lines else 0), done.output
    return {line[14:].partition(":")[0]: line for line in lines}


@pytest.mark.parametrize("number", range(len(FAULTS)), ids=[*FAULTS])
def test_a_fault_is_named(number: int, tmp_path: Path) -> None:
    """The check of its kind is broken; it says at which state, robot or parameter."""
    fault = [*FAULTS][number]
    file = tmp_path / f"fault_{number}.py"
    file.write_text(source_of(fault))
    found = broken(f"{file}:Faulty")
    expected = FAULTS[fault][0]
    assert expected in found
    assert len(found[expected]) > len("BROKEN        ") + len(expected) + 20


def test_without_a_fault_nothing_is_named(tmp_path: Path) -> None:
    """The formulation into which they are put keeps its promises."""
    file = tmp_path / "sound.py"
    file.write_text(HEAD)
    assert broken(f"{file}:Sound") == {}
