"""The contract's clause on parameters: every number has a range, and its ends can be asked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import inf, isfinite, isnan, nan
from types import UnionType
from typing import Any, Union, get_args, get_origin

from dikbench.errors import CannotAnswer, DikbenchError
from dikbench.parameters import Parameter, check_parameters, parameters_of
from dikbench.problem.problem import Formulation
from dikbench.simulation.status import Status
from dikbench.testing.asked import Asked, asked_of

WRONG = {Status.FORMULATION_ERROR, Status.WRONG_SHAPE, Status.NOT_FINITE}


def check_ranges(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that every number has a `Range`, and that its ends give an answer or say why not.

    What is outside of a range, and NaN, must be refused by an error that names the parameter. A
    formulation with a number at an end of its range answers the first state of the contract, or
    raises `CannotAnswer`.
    """
    asked = asked_of(formulation, solver)
    assert_ranges(asked.formulation)
    state = next(asked.states(), None)
    for name, value in ends_of(asked.formulation) if state is not None else ():
        try:
            changed = changed_to(asked.formulation, name, value)
            given = Asked(changed, asked.selector)
        except DikbenchError:
            continue  # it says why there is no such formulation
        except Exception as error:
            raise AssertionError(
                f"{name}={value}: raised {type(error).__name__}: {error}"
            ) from error
        assert state is not None
        try:
            answer = given.answer(state.problem)
        except CannotAnswer:
            continue
        if answer.status in WRONG:
            raise AssertionError(
                f"{name}={value}: {state.label}: {answer.status.value}: {answer.message}"
            )


def assert_ranges(plugin: object) -> None:
    """Assert that a plug-in's numbers have ranges, and that it refuses what is outside of them."""
    kind: Any = type(plugin)
    for name, parameter in parameters_of(kind).items():
        if not parameter.numeric:
            continue
        if parameter.range is None:
            raise AssertionError(
                f"{name} is a number without a Range; valid: {name}: Annotated[float, Range(0.0)]"
            )
        for value in outside(parameter):
            try:
                changed_to(plugin, name, value)
            except DikbenchError as error:
                if name not in str(error):
                    raise AssertionError(
                        f"{name}={value}: the error does not name it: {error}"
                    ) from error
            except Exception as error:
                said = f"{type(error).__name__}: {error}"
                raise AssertionError(f"{name}={value}: raised {said}") from error
            else:
                raise AssertionError(f"{name}={value} is accepted; valid: {parameter.valid}")


def changed_to(plugin: Any, name: str, value: object) -> Any:
    """Return a plug-in with another value of a parameter, checked as the harness checks it.

    Raises:
        DikbenchError: if the value is not valid.
    """
    changes: dict[str, Any] = {name: value}
    made = replace(plugin, **changes)
    check_parameters(made)
    return made


def ends_of(plugin: object) -> Iterator[tuple[str, float]]:
    """Yield the names of the numbers of a plug-in, each with the ends of its ranges."""
    kind: Any = type(plugin)
    for name, parameter in parameters_of(kind).items():
        if parameter.numeric and parameter.range is not None:
            for value in ends(parameter):
                yield name, value


def outside(parameter: Parameter) -> list[float]:
    """List numbers that a parameter must not be: NaN, infinity, and what is next to its ends."""
    found = [nan, inf, -inf]
    assert parameter.range is not None
    for end, away in ((parameter.range.low, -1.0), (parameter.range.high, 1.0)):
        if isfinite(end):
            step = 1.0 if _is_whole(parameter) else max(1e-6, 1e-6 * abs(end))
            found.append(end + away * step)
    return [value for value in found if not parameter.range.holds(value)]


def ends(parameter: Parameter) -> list[float]:
    """List the finite ends of the range of a parameter and of the bounds in which it is drawn."""
    assert parameter.range is not None
    found = [parameter.range.low, parameter.range.high]
    if parameter.drawn is not None and not isnan(parameter.drawn.low):
        found += [parameter.drawn.low, parameter.drawn.high]
    finite = [end for end in dict.fromkeys(found) if isfinite(end)]
    return [int(end) for end in finite] if _is_whole(parameter) else finite


def _is_whole(parameter: Parameter) -> bool:
    union = get_origin(parameter.type) in (Union, UnionType)
    return int in (get_args(parameter.type) if union else [parameter.type])
