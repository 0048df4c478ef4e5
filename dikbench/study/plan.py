"""The plan of a study: all its trials, each once."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import msgspec

from dikbench.errors import DikbenchError
from dikbench.metrics import other_metrics
from dikbench.plugins.building import make_formulation, make_plant, scenario_parameters
from dikbench.plugins.building_together import make_scenarios
from dikbench.plugins.drawing import Cell
from dikbench.problem.problem import Formulation, program_of
from dikbench.scenario.oracle import ORACLE, ORACLES
from dikbench.selector import Selector, parse_selector
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver, why_not
from dikbench.study.identity import trial_id
from dikbench.study.instances import accepted, draw_missing, numbers_of
from dikbench.study.split import check_split
from dikbench.study.study import Cells, Study, metric_named, naming
from dikbench.study.trial import NO_SOLVER, Trial

SCENARIOS_BUILT_FIRST: Final = 40
"""Number of scenarios that are built before anything runs; of the others the parameters are
checked, and a failed certificate gives a skipped row."""

IDEAL_PLANT: Final = "ideal"


class PlannedTrial(msgspec.Struct, frozen=True):
    """A trial, its id, and the reason if it cannot run."""

    id: str
    trial: Trial
    skip: str = ""


def draw_cells(study: Study) -> list[Cell]:
    """Draw the instances of a study: selector and seed of each."""
    return accepted(draw_missing(study))


def expand(
    study: Study, draw: Callable[[Study], Sequence[Cell]] = draw_cells
) -> list[PlannedTrial]:
    """List every trial of a study, in a fixed order, each once.

    Names, parameters and solvers are checked, and the first scenarios are built, so that mistakes
    are found before anything runs. A formulation and a solver that do not work together stay in
    the plan, with the reason.

    Args:
        study: the study.
        draw: gives selector and seed of the instances of a study that has some.

    Raises:
        DikbenchError: on the first selector that does not name anything valid, or an instance that
            cannot be drawn.
    """
    for plant in map(parse_selector, [*study.plants, *(p for c in study.cells for p in c.plants)]):
        with naming(plant, study.name):
            make_plant(plant)
    for metric in study.metrics:
        with naming(metric, study.name):
            metric_named(metric)
    other_metrics(study.metrics)
    _check_timing(study)
    columns: list[tuple[Cells, Selector, list[tuple[Selector, str]]]] = [
        (cells, formulation, _solvers_for(study, formulation, cells.solvers))
        for cells in study.cells
        for formulation in map(parse_selector, cells.formulations)
    ]
    drawn = _drawn(study, draw)
    planned: dict[str, PlannedTrial] = {}
    for cells, formulation, solvers in columns:
        plants, references = (
            chosen or asked
            for chosen, asked in zip(
                ways_of(formulation.name),
                (cells.plants or study.plants, study.references),
                strict=True,
            )
        )
        for solver, skip in solvers:
            for (scenario, seed), plant, reference in _in_order(
                drawn[cells.scenarios or study.scenarios], plants, references
            ):
                trial = Trial(formulation, scenario, solver, plant, reference, seed)
                name = trial_id(trial)
                planned.setdefault(name, PlannedTrial(name, trial, skip))
    return list(planned.values())


def ways_of(formulation: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the plants and the references with which a formulation runs, whatever a study asks.

    Empty ones are those that the study asks for. Oracles have no feedback: plants make no
    difference, and to a motion at its nominal speed reference modes make none.

    Args:
        formulation: its name.
    """
    plants = (IDEAL_PLANT,) if formulation in ORACLES else ()
    return plants, ("time",) if formulation == ORACLE else ()


def _in_order(
    drawn: Sequence[Cell], plants: Sequence[str], references: Sequence[str]
) -> Iterator[tuple[Cell, Selector, str]]:
    """Yield scenarios and seeds with plants and references, the seeds of each together."""
    for _, cells in itertools.groupby(drawn, key=lambda cell: cell[0]):
        for plant, reference, cell in itertools.product(
            map(parse_selector, plants), references, list(cells)
        ):
            yield cell, plant, reference


def _drawn(
    study: Study, draw: Callable[[Study], Sequence[Cell]]
) -> dict[tuple[str, ...], Sequence[Cell]]:
    """Return selector and seed of the scenarios of a study, and of those of its cells.

    Raises:
        DikbenchError: if one cannot be built or drawn, or is of another split.
    """
    found: dict[tuple[str, ...], Sequence[Cell]] = {}
    for texts in (study.scenarios, *(cells.scenarios for cells in study.cells if cells.scenarios)):
        if study.instances:
            numbers_of(study)
            found[texts] = draw(msgspec.structs.replace(study, scenarios=texts))
        else:
            scenarios = [parse_selector(text) for text in texts]
            _check_scenarios(study, scenarios)
            found[texts] = list(itertools.product(scenarios, study.seeds))
        if study.split:
            check_split(study.name, study.split, [seed for _, seed in found[texts]])
    return found


def _check_scenarios(study: Study, scenarios: Sequence[Selector]) -> None:
    """Build the first scenarios, and check the parameters of the others."""
    first, others = scenarios[:SCENARIOS_BUILT_FIRST], scenarios[SCENARIOS_BUILT_FIRST:]
    built = make_scenarios((scenario, study.seeds[0]) for scenario in first)
    for scenario, found in zip(first, built, strict=True):
        with naming(scenario, study.name):
            if isinstance(found, BaseException):
                raise found
    for scenario in others:
        with naming(scenario, study.name):
            scenario_parameters(scenario)


def _check_timing(study: Study) -> None:
    if study.timing is None:
        return
    reference = parse_selector(study.timing.reference)
    if reference.name in ORACLES or program_of(make_formulation(reference)):
        raise DikbenchError(
            f"study {study.name}: timing.reference {str(reference)!r} must be a formulation that "
            "needs no solver, such as 'dls'"
        )


def _check_frozen(formulation: Formulation) -> None:
    """Check that a formulation remembers nothing: times are of shuffled problems.

    Raises:
        DikbenchError: if its class is not frozen.
    """
    parameters = getattr(formulation, "__dataclass_params__", None)
    if parameters is not None and not parameters.frozen:
        raise DikbenchError(
            f"class {type(formulation).__name__} may change itself from one control step to the "
            "next; valid: @dataclass(frozen=True) above it"
        )


def _solvers_for(
    study: Study, formulation: Selector, solvers: Sequence[str]
) -> list[tuple[Selector, str]]:
    """Return the solvers with which a formulation runs, each with the reason if it cannot."""
    program = None
    if formulation.name not in ORACLES:
        with naming(formulation, study.name):
            made = make_formulation(formulation)
            _check_frozen(made)
            program = program_of(made)
    parsed = []
    for selector in map(parse_selector, solvers):
        with naming(selector, study.name):
            parsed.append((selector, parse_solver(selector)))
    if program is None:
        return [(NO_SOLVER, "")]
    if not parsed:
        default = DEFAULT_SOLVER[program]
        parsed = [(parse_selector(default), parse_solver(default))]
    return [(selector, why_not(solver, program)) for selector, solver in parsed]
