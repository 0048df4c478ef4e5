"""The contract suite at some of its states."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module

import pytest

from dikbench.testing.states import states

STRIDE = 7
"""One state in so many is asked in the normal run. No period of the states divides it: all
speeds, limits, rows and motions before come up."""


@cache
def pickled_states() -> list[bytes]:
    """Make every state once: to copy some of them takes less than to make them all."""
    return [pickle.dumps(state) for state in states()]


@contextmanager
def few_states(turn: int, stride: int = STRIDE) -> Iterator[None]:
    """Have the contract ask at one state in so many meanwhile, the first of them in turns."""
    few = pickled_states()[turn % stride :: stride]
    with pytest.MonkeyPatch.context() as patch:
        for name in ("asked", "sight"):
            module = import_module(f"dikbench.testing.{name}")
            patch.setattr(module, "states", lambda: map(pickle.loads, few))
        yield
