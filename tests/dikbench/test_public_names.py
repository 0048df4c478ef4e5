"""What `import dikbench` offers."""

from __future__ import annotations

import re
from pathlib import Path

import dikbench
from dikbench.problem import tasks


def test_every_public_name_is_there() -> None:
    """Each resolves, to the object that its module defines under this name."""
    for name in dikbench.__all__:
        assert getattr(dikbench, name).__name__ == name


def test_tasks_of_the_readme_are_public() -> None:
    """Every task that the README names can be had from `dikbench` itself."""
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(\w+Task)`", readme))
    assert len(named) == 6
    for name in named:
        assert getattr(dikbench, name) is getattr(tasks, name)
        assert name in dikbench.__all__
