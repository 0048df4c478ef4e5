"""Studies: TOML files that select cells and set their parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Final, Literal

import msgspec

from dikbench.errors import DikbenchError, unknown
from dikbench.metrics import other_metrics
from dikbench.plugins.building import (
    in_declared_order,
    make_formulation,
    make_plant,
    scenario_parameters,
)
from dikbench.plugins.source import digest
from dikbench.problem.problem import program_of
from dikbench.programs.quadratic_program import ProgramKind
from dikbench.scenario.oracle import ORACLES
from dikbench.selector import Selector, alternatives, parse_selector
from dikbench.solvers.catalogue.back_ends import (
    BACK_ENDS,
    is_installed,
    parse_solver,
)
from dikbench.study.explained import explained

DEFAULT_STUDY = "quick"

SELECTED: Final = "selection"
"""The name of a study that was selected without naming one."""

CHECKED: Final = "check-"
"""What the name of a study begins with that is run with straw laws."""

KIND_OF_AXIS: Final[Mapping[str, Literal["formulation", "scenario", "plant"]]] = MappingProxyType(
    {"formulations": "formulation", "scenarios": "scenario", "plants": "plant"}
)

DIGITS: Final = 8
"""So many of a digest distinguish the folders of selections."""

NOT_EMPTY = msgspec.Meta(min_length=1)
Names = Annotated[tuple[str, ...], NOT_EMPTY]


class Cells(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Formulations, and with what each is run.

    Attributes:
        formulations: their selectors.
        solvers: the solvers of those that need one; empty: the default one.
        scenarios, plants: in place of those of the study; empty: those.
    """

    formulations: Names
    solvers: tuple[str, ...] = ()
    scenarios: tuple[str, ...] = ()
    plants: tuple[str, ...] = ()


class TimingSettings(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """The timing pass: a formulation is timed on the scenarios that its cells run.

    Attributes:
        reference: the formulation whose run gives the problems of each scenario.
        problems: number of contiguous problems, from the middle of the run.
        rounds: number of rounds in which they are solved.
        scenarios: those of the study or its cells to time; empty: all.
    """

    reference: str
    problems: Annotated[int, msgspec.Meta(ge=1)] = 100
    rounds: Annotated[int, msgspec.Meta(ge=1)] = 5
    scenarios: tuple[str, ...] = ()


class Study(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A selection of cells, with selectors as texts.

    Attributes:
        description: one line.
        cells: formulations with their solvers.
        scenarios: selectors of scenarios.
        plants, references, seeds: see `Trial`.
        split: "train" or "test" restricts the study to the seeds, or the numbers of instances, of
            that split (see `dikbench.study.split`); empty: any.
        instances: number of random instances that are drawn of each scenario, in place of seeds;
            what its selector gives is fixed (see `dikbench.study.instances`). 0: none are drawn.
        fraction: the share of them that is run, the first ones.
        example: the scenario whose runs are drawn over time; default: the first one.
        timing: the timing pass; None: no timing.
        metrics: metrics of other authors that are computed beside those of dikbench.
        name: name of the study; default: the file's.
    """

    description: str
    cells: Annotated[tuple[Cells, ...], NOT_EMPTY]
    scenarios: Names
    plants: Names = ("ideal", "saturating")
    references: Annotated[tuple[Literal["time", "path"], ...], NOT_EMPTY] = ("time",)
    seeds: Annotated[tuple[Annotated[int, msgspec.Meta(ge=0)], ...], NOT_EMPTY] = (0,)
    split: Literal["", "train", "test"] = ""
    instances: Annotated[int, msgspec.Meta(ge=0)] = 0
    fraction: Annotated[float, msgspec.Meta(gt=0, le=1)] = 1.0
    example: str = ""
    timing: TimingSettings | None = None
    metrics: tuple[str, ...] = ()
    name: str = ""


def shipped_studies() -> dict[str, Path]:
    """Return the files of the studies that come with dikbench, by name."""
    folder = Path(str(resources.files("dikbench.study") / "studies"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load_study(name_or_file: str) -> Study:
    """Read a shipped study or a TOML file.

    Raises:
        DikbenchError: if there is no such study or file, or it is not a study.
    """
    shipped = shipped_studies()
    if name_or_file in shipped:
        path = shipped[name_or_file]
    elif name_or_file.endswith(".toml") or Path(name_or_file).is_file():
        path = Path(name_or_file)
    else:
        raise unknown("study", name_or_file, shipped, "(or give the path of a .toml file)")
    try:
        study = msgspec.toml.decode(path.read_bytes(), type=Study)
    except OSError as error:
        raise DikbenchError(f"study {path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise DikbenchError(f"study {path}: not a text file in UTF-8") from None
    except msgspec.ValidationError as error:
        raise DikbenchError(f"study {path}: {explained(str(error))}") from None
    except msgspec.DecodeError as error:
        raise DikbenchError(f"study {path}: not valid TOML: {error}") from None
    try:
        spread = _spread(msgspec.structs.replace(study, name=study.name or path.stem))
        check_instances(spread)
    except DikbenchError as error:
        raise DikbenchError(f"study {path}: {error}") from None
    _check_values(spread, path)
    return spread


def check_instances(study: Study) -> None:
    """Check that what excludes instances is not given with them.

    Raises:
        DikbenchError: if it is.
    """
    if study.fraction != 1.0 and not study.instances:
        raise DikbenchError("fraction is of instances; valid: with instances=N")
    if study.instances and study.seeds != (0,):
        raise DikbenchError("instances have seeds of their own; valid: instances or seeds")
    if study.instances and study.timing is not None:
        raise DikbenchError("instances are not timed; valid: instances without [timing]")


def _check_values(study: Study, path: Path) -> None:
    """Build what each selector of a file names, so that an error says where it stands.

    Raises:
        DikbenchError: on the first selector that does not name anything valid.
    """
    named: list[tuple[str, str, Callable[[str], object]]] = []
    makers: dict[str, Callable[[str], object]] = {
        "scenarios": scenario_parameters,
        "plants": make_plant,
    }
    for text in study.metrics:
        named.append(("metrics", text, metric_named))
    named += [(axis, text, makers[axis]) for axis in makers for text in getattr(study, axis)]
    for number, cell in enumerate(study.cells):
        for axis, make in makers.items():
            named += [(f"cells[{number}].{axis}", text, make) for text in getattr(cell, axis)]
        for text in cell.formulations:
            named.append((f"cells[{number}].formulations", text, program_named))
        for text in cell.solvers:
            named.append((f"cells[{number}].solvers", text, _check_solver))
    for where, text, make in named:
        try:
            make(text)
        except DikbenchError as error:
            raise DikbenchError(f"study {path}: {where}: {error}") from None


def _spread(study: Study) -> Study:
    """Return the study with one value per parameter in each selector (see `alternatives`)."""
    timing, example = study.timing, study.example
    if timing is not None:
        timing = msgspec.structs.replace(timing, scenarios=each_of("scenarios", timing.scenarios))
    return msgspec.structs.replace(
        study,
        cells=tuple(
            Cells(*(each_of(axis, getattr(cell, axis)) for axis in Cells.__struct_fields__))
            for cell in study.cells
        ),
        scenarios=each_of("scenarios", study.scenarios),
        plants=each_of("plants", study.plants),
        example=str(in_declared_order("scenario", example)) if example else "",
        timing=timing,
    )


def each_of(axis: str, selectors: Iterable[str]) -> tuple[str, ...]:
    """List the selectors that those of an axis stand for, each once, in canonical form."""
    found: dict[str, None] = {}
    for given in selectors:
        for one in alternatives(given):
            if "," in one.name and ".py:" not in one.name:
                raise DikbenchError(
                    f"{given!r} is one name; valid: each of the {axis} on its own, as options "
                    "that are repeated or entries of a list"
                )
            found[str(_canonical(axis, one))] = None
    return tuple(found)


def _canonical(axis: str, selector: Selector) -> Selector:
    """Put the parameters of a selector in one order."""
    if axis == "solvers":
        return selector.ordered(("interface", "preset", *sorted(selector.parameters)))
    return in_declared_order(KIND_OF_AXIS[axis], selector)


def _check_solver(text: str) -> None:
    """Check a solver's selector, unless its library is missing here, which a plan says."""
    name = parse_selector(text).name
    if name not in BACK_ENDS or is_installed(name):
        parse_solver(text)


def folder_of(study: Study) -> str:
    """Name the folder of a study's results: its name, and of a selection what was selected.

    Two selections have a folder each, so that no table mixes them; the same one given again has
    the same.
    """
    if study.name != SELECTED:
        return study.name
    selected = msgspec.to_builtins(study)
    selected["fraction"] = 1.0  # a larger one continues the run
    if not study.metrics:  # a folder of a dikbench that knew none is the same
        del selected["metrics"]
    return f"{SELECTED}-{digest(msgspec.json.encode(selected).decode())[:DIGITS]}"


def metric_named(text: str | Selector) -> object:
    """Find a metric by its selector, which has no parameters.

    Raises:
        DikbenchError: if there is none.
    """
    selector = parse_selector(text)
    if selector.parameters:
        raise DikbenchError(
            f"metric {selector}: a metric has no parameters; valid: {selector.name}"
        )
    return other_metrics([selector.name])


def program_named(formulation: str | Selector) -> ProgramKind | None:
    """Return what a formulation needs a solver for; the oracles need none."""
    if parse_selector(formulation).name in ORACLES:
        return None
    with naming(formulation):
        return program_of(make_formulation(formulation))


@contextmanager
def naming(selector: str | Selector, study: str = "") -> Iterator[None]:
    """Have an error say which selector (of which study) it is about: a sweep has many."""
    try:
        yield
    except DikbenchError as error:
        where = f"study {study}: " if study else ""
        named = "" if str(selector) in str(error) else f"{str(selector)!r}: "
        raise DikbenchError(f"{where}{named}{error}") from None
