"""The instances of a study: drawn, rejected by their certificates, drawn again, and counted."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Final

from dikbench.errors import DikbenchError
from dikbench.plugins.building_together import make_scenarios
from dikbench.plugins.drawing import SEEDS_APART, Cell, drawn_cell
from dikbench.selector import Selector, parse_selector
from dikbench.study.identity import scenario_id
from dikbench.study.split import SPLITS, split_of
from dikbench.study.study import Study

MOST_ATTEMPTS: Final = 50
"""Number of attempts at an instance. Where one in five is accepted, one in 70 000 instances needs
more."""

UNSPLIT: Final = "test"
"""The split whose numbers the instances of a study without one have."""


@dataclass(frozen=True)
class Attempt:
    """An attempt at an instance: a scenario that was drawn.

    Attributes:
        given: the selector that fixes what is not drawn.
        source: its id, which changes with the source of the family.
        number: of the instance.
        scenario: the selector that was drawn.
        seed: of the scenario.
        rejected: why the scenario cannot be built or has no certificate; empty for an instance.
    """

    given: str
    source: str
    number: int
    scenario: str
    seed: int
    rejected: str = ""


COLUMNS: Final = tuple(field.name for field in fields(Attempt))

Progress = Callable[[int], object]
"""Is told how many more instances are drawn."""


def numbers_of(study: Study) -> range:
    """Return the numbers of the instances of a study: the first of its split.

    Raises:
        DikbenchError: if its split has fewer.
    """
    split = study.split or UNSPLIT
    allowed = SPLITS[split]
    if study.instances > len(allowed):
        raise DikbenchError(
            f"study {study.name}: instances={study.instances} is more than the {split} split has; "
            f"valid: 1 to {len(allowed)}"
        )
    return allowed[: max(1, round(study.instances * study.fraction))]


def instances_among(
    cells: Iterable[tuple[str, int]], study: Study, attempts: Sequence[Attempt]
) -> set[tuple[str, int]]:
    """Return which scenarios and seeds are instances of a study.

    Args:
        cells: scenarios and seeds.
        study: with `instances`.
        attempts: what was drawn for it; where nothing is known of it, those are returned that may
            be instances by their number and what the study fixes.
    """
    numbers, given = numbers_of(study), [parse_selector(text) for text in study.scenarios]
    if attempts:
        names = {str(each) for each in given}
        known = {
            (each.scenario, each.seed)
            for each in attempts
            if each.given in names and each.number in numbers and not each.rejected
        }
        return known.intersection(cells)
    drawn = {cell: parse_selector(cell[0]) for cell in cells if cell[1] % SEEDS_APART in numbers}
    return {
        cell
        for cell, scenario in drawn.items()
        for each in given
        if each.name == scenario.name and each.parameters.items() <= scenario.parameters.items()
    }


def draw_instance(given: Selector, number: int) -> list[Attempt]:
    """Draw one instance; its last attempt is the one that is accepted.

    Raises:
        DikbenchError: if the number is in no split, nothing of the selector is left to draw, or
            every attempt is rejected.
    """
    if split_of(number) is None or number >= SPLITS["test"].stop:
        valid = " and ".join(f"{s.start} to {s.stop - 1} ({name})" for name, s in SPLITS.items())
        raise DikbenchError(f"instance {number} is in no split; valid: {valid}")
    return draw(given, [number])


def draw(
    given: Selector,
    numbers: Sequence[int],
    progress: Progress = lambda _: None,
    most: int | None = None,
) -> list[Attempt]:
    """Draw the instances of a selector, those that are rejected again with the same robot.

    Args:
        given: what is fixed.
        numbers: of the instances.
        progress: is told how many more instances there are.
        most: number of attempts at each; default: `MOST_ATTEMPTS`.

    Returns:
        All attempts, instance by instance.

    Raises:
        DikbenchError: if nothing of the selector is left to draw, or all attempts at an instance
            are rejected.
    """
    source, waiting = scenario_id_of(given), list(numbers)
    found: dict[int, list[Attempt]] = {number: [] for number in numbers}
    most = MOST_ATTEMPTS if most is None else most
    for attempt in range(most):
        cells = [drawn_cell(given, number, attempt) for number in waiting]
        for number, cell, reason in zip(waiting, cells, _rejections(cells), strict=True):
            scenario, seed = cell
            found[number].append(Attempt(str(given), source, number, str(scenario), seed, reason))
        before = len(waiting)
        waiting = [number for number in waiting if found[number][-1].rejected]
        progress(before - len(waiting))
        if not waiting:
            return [each for attempts in found.values() for each in attempts]
    last = found[waiting[0]][-1]
    robot = parse_selector(last.scenario).parameters.get("robot", "its own")
    raise DikbenchError(
        f"scenario {given}: robot {robot} has no instance {last.number} in {most} "
        f"attempts; valid: a selector that fixes less, or other values; the last one: "
        f"{last.rejected}"
    )


def scenario_id_of(given: Selector) -> str:
    """Return the id of what an author fixed, which need not be a scenario of itself.

    Raises:
        DikbenchError: if there is no such family or parameter, or a value is out of range.
    """
    try:
        return scenario_id(given)
    except DikbenchError:
        # Valid with other values than the defaults, such as those of another robot.
        return scenario_id(drawn_cell(given, SPLITS[UNSPLIT].start)[0])


def _rejections(cells: Iterable[Cell]) -> Iterator[str]:
    """Yield why each scenario is rejected; an empty text where it is not."""
    for made in make_scenarios(cells):
        if isinstance(made, MemoryError):
            raise made
        yield " ".join(str(made).split()) if isinstance(made, BaseException) else ""


def accepted(attempts: Iterable[Attempt]) -> list[Cell]:
    """Return selector and seed of the instances among attempts."""
    return [(parse_selector(a.scenario), a.seed) for a in attempts if not a.rejected]


def draw_missing(
    study: Study,
    known: Iterable[Attempt] = (),
    progress: Progress = lambda _: None,
    keep: Callable[[list[Attempt]], object] = lambda _: None,
) -> list[Attempt]:
    """Draw the instances of a study that are not known.

    Args:
        study: with `instances`.
        known: attempts of earlier; those of another source of their family are left out.
        progress: is told how many more instances there are.
        keep: is handed all attempts, those of earlier too, whenever there are more.

    Returns:
        The attempts at the study's own instances, selector by selector, by number.

    Raises:
        DikbenchError: as `draw`.
    """
    kept: dict[tuple[str, str, int], list[Attempt]] = {}
    for each in known:
        kept.setdefault((each.given, each.source, each.number), []).append(each)
    found: list[Attempt] = []
    for given in map(parse_selector, study.scenarios):
        # What is fixed at its default is the same scenario as what is left to be drawn.
        key, numbers = (str(given), scenario_id_of(given)), numbers_of(study)
        missing = [number for number in numbers if (*key, number) not in kept]
        progress(len(numbers) - len(missing))
        if missing:
            kept = {of: a for of, a in kept.items() if of[0] != key[0] or of[1] == key[1]}
            for each in draw(given, missing, progress):
                kept.setdefault((*key, each.number), []).append(each)
            keep([each for attempts in kept.values() for each in attempts])
        found += [each for number in numbers for each in kept[*key, number]]
    return found
