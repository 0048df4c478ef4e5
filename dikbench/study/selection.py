"""What a user selects of a study: replacements of its axes."""

from __future__ import annotations

from typing import Any

import msgspec

from dikbench.errors import DikbenchError
from dikbench.selector import Selector, parse_selector
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER
from dikbench.study.study import (
    KIND_OF_AXIS,
    SELECTED,
    Cells,
    Study,
    check_instances,
    each_of,
    program_named,
)


class Selection(msgspec.Struct, frozen=True):
    """Replacements of the axes of a study; an empty axis keeps the study's own.

    Attributes:
        instances: number of instances of each scenario, in place of seeds; 0: the study's own.
        fraction: the share of them that is run.
        metrics: metrics of other authors.
    """

    formulations: tuple[str, ...] = ()
    scenarios: tuple[str, ...] = ()
    solvers: tuple[str, ...] = ()
    seeds: tuple[int, ...] = ()
    plants: tuple[str, ...] = ()
    references: tuple[str, ...] = ()
    instances: int = 0
    fraction: float = 1.0
    metrics: tuple[str, ...] = ()


def select(base: Study, selection: Selection, *, named: bool) -> Study:
    """Return a study with some of its axes replaced.

    Without solvers in the selection, a formulation has the solvers that a named study has for it,
    else the default solver.

    Args:
        base: the study to start from.
        selection: what replaces its axes.
        named: whether the user named the study.
    """
    if selection == Selection():
        return base
    selection = msgspec.structs.replace(
        selection,
        **{axis: each_of(axis, getattr(selection, axis)) for axis in (*KIND_OF_AXIS, "solvers")},
    )
    cells = base.cells
    if selection.formulations:
        chosen = map(parse_selector, selection.formulations)
        cells = tuple(
            cell for formulation in chosen for cell in _cells_for(base, formulation, named)
        )
    replaced: dict[str, tuple[str, ...]] = {
        axis: () for axis in ("scenarios", "plants") if getattr(selection, axis)
    }
    if selection.solvers:
        replaced["solvers"] = selection.solvers
    cells = tuple(msgspec.structs.replace(cell, **replaced) for cell in cells)
    changes: dict[str, Any] = {
        axis: getattr(selection, axis)
        for axis in ("scenarios", "seeds", "plants", "references", "metrics")
        if getattr(selection, axis)
    }
    if selection.seeds and selection.instances:
        raise DikbenchError("instances have seeds of their own; valid: instances or seeds")
    if selection.seeds:
        changes["instances"] = 0
    if selection.instances:
        changes |= {"instances": selection.instances, "seeds": (0,), "timing": None}
    if selection.fraction != 1.0:
        changes["fraction"] = selection.fraction
    if base.example not in (selection.scenarios or base.scenarios):
        changes["example"] = ""
    if base.timing is not None and selection.scenarios and not selection.instances:
        changes["timing"] = msgspec.structs.replace(base.timing, scenarios=())
    if not named:
        changes |= {"name": SELECTED, "description": "Selected on the command line"}
    made = msgspec.structs.replace(base, cells=cells, **changes)
    check_instances(made)
    return made


def _cells_for(base: Study, formulation: Selector, named: bool) -> list[Cells]:
    """Return the cells of a formulation that was selected: a named study's for it, else its own."""
    name, program = (str(formulation),), program_named(formulation)
    if named:
        found = [
            msgspec.structs.replace(cell, formulations=name)
            for cell in base.cells
            if formulation.name in {parse_selector(text).name for text in cell.formulations}
        ]
        if found:
            return found
    return [Cells(name, () if program is None else (DEFAULT_SOLVER[program],))]
