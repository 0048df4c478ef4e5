"""The floors of the house: who imports whom, read from the sources."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple

import pytest

CHECKOUT: Final = Path(__file__).parents[2]

FIRST_LEVEL: Final = (
    "annotations", "arrays", "errors", "linear_algebra", "linear_inequalities", "parameters",
    "selector", "user_code",
)  # fmt: skip
"""Modules beside the rooms, the lowest floor."""

ROOMS: Final = (
    "robots",
    "programs",
    "solvers",
    "problem",
    "scenario",
    "plugins",
    "simulation",
    "metrics",
    "testing",
    "study",
    "statistics",
    "results",
    "run",
    "viewer",
    "report",
    "tuning",
    "invariants",
    "published",
    "advice",
    "cli",
)
"""From the ground up: a room imports from those before it, and from nothing behind it."""

DOORS: Final = (
    "dikbench.problem",
    "dikbench.scenario",
    "dikbench.metrics",
    "dikbench.testing",
    "dikbench.errors",
)
"""What formulations and families may import of the harness."""

FACE: Final = ("dikbench/__init__.py", "dikbench/__main__.py")


class Import(NamedTuple):
    """One import: the file in which it stands, and the module that is imported."""

    file: str
    module: str


@cache
def imports_of(root: Path) -> list[Import]:
    """Read every import of the three packages below a folder, wherever in a file it stands."""
    found = []
    for package in ("dikbench", "formulations", "scenarios"):
        for file in sorted((root / package).rglob("*.py")):
            name = file.relative_to(root).as_posix()
            found += [Import(name, module) for module in _imported(root, file)]
    return found


def _imported(root: Path, file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parts = file.relative_to(root).with_suffix("").parts
                base = ".".join([*parts[: -node.level], *filter(None, [base])])
            for alias in node.names:
                inner = f"{base}.{alias.name}"
                yield inner if _is_module(root, inner) else base


def _is_module(root: Path, module: str) -> bool:
    path = root.joinpath(*module.split("."))
    return path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()


def floor(module: str) -> int | None:
    """Return the floor of a module of the harness; None for any other, and for the face."""
    parts = module.split(".")
    if parts[0] != "dikbench" or len(parts) < 2:
        return None
    return ROOMS.index(parts[1]) if parts[1] in ROOMS else -1


def module_of(file: str) -> str:
    """Return the module that a file holds."""
    return file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def upward(imports: list[Import]) -> list[str]:
    """List the imports of the harness that run up the floors."""
    return [
        f"{file} imports {module}, which is on a higher floor"
        for file, module in imports
        if file not in FACE
        and (here := floor(module_of(file))) is not None
        and (there := floor(module)) is not None
        and there > here
    ]


def looking_back(imports: list[Import]) -> list[str]:
    """List the imports of formulations or scenarios by the harness."""
    return [
        f"{file} imports {module}"
        for file, module in imports
        if file.startswith("dikbench/") and module.split(".")[0] in ("formulations", "scenarios")
    ]


def past_the_doors(imports: list[Import]) -> list[str]:
    """List what formulations and families import of the harness but the doors."""
    return [
        f"{file} imports {module}; valid: {', '.join(DOORS)}"
        for file, module in imports
        if not file.startswith("dikbench/")
        and module.split(".")[0] == "dikbench"
        and module not in DOORS
    ]


def homeless(root: Path) -> list[str]:
    """List the modules of the harness that stand in no room."""
    found = []
    for file in sorted((root / "dikbench").rglob("*.py")):
        name = file.relative_to(root).as_posix()
        first = name.split("/")[1].removesuffix(".py")
        if name not in FACE and first not in (*ROOMS, *FIRST_LEVEL):
            found.append(f"{name} stands in no room")
    return found


def cycles(imports: list[Import]) -> list[str]:
    """List the cycles of folders: sets of folders each of which leads to each other.

    What a door takes together is no import of its folder: `__init__` of a package is left out.
    """
    edges: dict[str, set[str]] = {}
    for file, module in imports:
        if file.endswith("__init__.py") or not module.startswith("dikbench."):
            continue
        here, there = file.rpartition("/")[0], _folder(module)
        if here != there and here.startswith("dikbench/"):
            edges.setdefault(here, set()).add(there)
    reached = {folder: _reachable(edges, folder) for folder in edges}
    return sorted(
        f"{folder} is in a cycle with {other}"
        for folder, others in reached.items()
        for other in others
        if folder < other and folder in reached.get(other, ())
    )


def _folder(module: str) -> str:
    path = module.replace(".", "/")
    is_package = (CHECKOUT / path).is_dir()
    return path if is_package else path.rpartition("/")[0]


def _reachable(edges: dict[str, set[str]], start: str) -> set[str]:
    found: set[str] = set()
    waiting = [start]
    while waiting:
        for folder in edges.get(waiting.pop(), set()) - found:
            found.add(folder)
            waiting.append(folder)
    return found


def test_imports_were_read() -> None:
    """The checks below look at hundreds of imports, of every room."""
    assert len(imports_of(CHECKOUT)) > 700
    assert {floor(module_of(file)) for file, _ in imports_of(CHECKOUT)} >= set(range(len(ROOMS)))


def test_no_import_runs_up_the_floors() -> None:
    """A room imports only from rooms below it; the harness never imports its plug-ins."""
    assert upward(imports_of(CHECKOUT)) == []
    assert looking_back(imports_of(CHECKOUT)) == []


def test_no_folder_is_in_a_cycle() -> None:
    """Folders, at any depth, form no cycle."""
    assert cycles(imports_of(CHECKOUT)) == []


def test_plug_ins_come_in_through_the_doors() -> None:
    """Formulations and families import nothing of the harness but its doors."""
    assert past_the_doors(imports_of(CHECKOUT)) == []


def test_every_module_is_in_a_room() -> None:
    """The first level of the harness holds the rooms and a handful of words."""
    assert homeless(CHECKOUT) == []


def test_tests_mirror_the_rooms() -> None:
    """Every folder of tests/dikbench has the name of a folder of dikbench."""
    tests = CHECKOUT / "tests" / "dikbench"
    folders = {
        file.parent.relative_to(tests).as_posix()
        for file in tests.rglob("test_*.py")
        if file.parent != tests
    }
    assert folders
    assert [name for name in folders if not (CHECKOUT / "dikbench" / name).is_dir()] == []


@pytest.mark.parametrize(
    ("check", "broken", "said"),
    [
        (upward, Import("dikbench/robots/robot.py", "dikbench.run.runner"), "higher floor"),
        (upward, Import("dikbench/errors.py", "dikbench.robots.robot"), "higher floor"),
        (looking_back, Import("dikbench/study/plan.py", "scenarios.reach"), "scenarios.reach"),
        (past_the_doors, Import("formulations/x.py", "dikbench.robots.robot"), "valid: dikbench"),
        (past_the_doors, Import("scenarios/x.py", "dikbench.run.runner"), "valid: dikbench"),
        (
            cycles,
            Import("dikbench/robots/collision/pairs.py", "dikbench.scenario.oracle"),
            "dikbench/robots/collision is in a cycle with",
        ),
    ],
)
def test_each_check_finds_what_it_looks_for(check: object, broken: Import, said: str) -> None:
    """One import that must not be, put among the real ones, is named."""
    assert callable(check)
    found = check([*imports_of(CHECKOUT), broken])
    assert any(said in line for line in found)


def test_a_module_in_no_room_is_found(tmp_path: Path) -> None:
    """A file, or a folder, on the first level that is no room."""
    for name in ("helpers.py", "misc/things.py", "robots/robot.py"):
        file = tmp_path / "dikbench" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("")
    assert homeless(tmp_path) == [
        "dikbench/helpers.py stands in no room",
        "dikbench/misc/things.py stands in no room",
    ]
