"""Objects built from selectors: texts become typed values, values a plug-in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final, Literal, TypeVar

import msgspec

from dikbench.errors import DikbenchError, in_words, unknown
from dikbench.parameters import Parameter, check_parameters, parameters_of
from dikbench.plugins.finding import formulation_plugin, plant_plugin, scenario_plugin
from dikbench.plugins.time_limit import time_limit
from dikbench.plugins.tuned import with_tuned
from dikbench.problem.problem import Formulation
from dikbench.scenario.certificate import CertificateFailed
from dikbench.scenario.family import Family
from dikbench.scenario.misfits import misfits
from dikbench.scenario.plant import Plant
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector, parse_selector

Made = TypeVar("Made")

LONGEST_BUILDING_S: Final = 50.0
"""Processor time after which the building of a scenario ends; a humanoid's takes some seconds."""


def make_formulation(text: str | Selector) -> Formulation:
    """Build a formulation from `name[parameter=value,...]` or `path/to/file.py:Class[...]`.

    Raises:
        DikbenchError: on an unknown name, file, class or parameter, a value out of range, or
            `[tuned]` where nothing is tuned.
    """
    selector = with_tuned(parse_selector(text))
    plugin = formulation_plugin(selector.name)
    make: Callable[..., Formulation] = partial(plugin.factory, **plugin.defaults)
    return _built(f"formulation {plugin.name}", make, plugin.parameters, selector)


def make_family(text: str | Selector) -> Family:
    """Build a scenario family from `name[parameter=value,...]` or `path/to/file.py:Class[...]`.

    Raises:
        DikbenchError: on an unknown name, file, class or parameter, or a value out of range.
    """
    selector = parse_selector(text)
    plugin = scenario_plugin(selector.name)
    if "seed" in selector.parameters:
        raise DikbenchError(f"scenario {str(selector)!r}: the seed is not a parameter; use --seed")
    make: Callable[..., Family] = partial(plugin.factory, **plugin.defaults)
    return _built(f"scenario {plugin.name}", make, plugin.parameters, selector)


def make_scenario(text: str | Selector, seed: int = 0) -> Scenario:
    """Build the scenario of a selector and a seed, and check its certificate and its parts.

    Raises:
        DikbenchError: on an unknown family or parameter, a value out of range, a number without a
            range, or parts that do not fit together.
        CertificateFailed: if a claim of its certificate does not hold.
    """
    family = make_family(text)
    try:
        _check_ranges(family)
        with time_limit(LONGEST_BUILDING_S, "its building"):
            made = family.scenario(seed)
        wrong = next(misfits(made), "")
    except CertificateFailed as error:
        raise CertificateFailed(str(text), error.failures) from None
    except MemoryError:
        raise
    except Exception as error:
        raise DikbenchError(f"scenario {text}: {_reason(error)}") from error
    if wrong:
        raise DikbenchError(f"scenario {text}: {wrong}")
    return made


def make_plant(text: str | Selector) -> Plant:
    """Build a plant from `ideal[noise=...,delay=...]` or `path/to/file.py:Class[...]`.

    Raises:
        DikbenchError: on an unknown name, file, class or parameter, or a value out of range.
    """
    selector = parse_selector(text)
    plugin = plant_plugin(selector.name)
    make: Callable[..., Plant] = partial(plugin.factory, **plugin.defaults)
    return _built(f"plant {plugin.name}", make, plugin.parameters, selector)


def scenario_parameters(text: str | Selector) -> Mapping[str, Any]:
    """Return the parameters of a scenario's selector with their values, defaults included.

    Raises:
        DikbenchError: on an unknown family or parameter, a value of the wrong type or out of
            range, or a number without a range.
    """
    family = make_family(text)
    _check_ranges(family)
    return {name: getattr(family, name) for name in parameters_of(type(family))}


def _check_ranges(family: Family) -> None:
    """Check that nothing leaves a number of a family open: rows of an infinite one say nothing.

    Raises:
        DikbenchError: if a number has no range.
    """
    for name, parameter in parameters_of(type(family)).items():
        if parameter.numeric and parameter.range is None:
            raise DikbenchError(
                f"class {type(family).__name__}: {name} is a number without a Range; valid: "
                f"{name}: Annotated[float, Range(0.0, 1.0)]"
            )


def in_declared_order(
    kind: Literal["formulation", "scenario", "plant"], text: str | Selector
) -> Selector:
    """Parse a selector and put its parameters in the order in which its class declares them.

    Selectors that differ in the order only become the same text, and `[tuned]` the parameters for
    which it stands. A selector that names nothing valid is returned unchanged; building from it
    gives the error.

    Raises:
        DikbenchError: if the text is no selector.
    """
    selector = parse_selector(text)
    try:
        if kind == "formulation":
            selector = with_tuned(selector)
        find = {
            "formulation": formulation_plugin,
            "scenario": scenario_plugin,
            "plant": plant_plugin,
        }[kind]
        return selector.ordered(find(selector.name).parameters)
    except DikbenchError:
        return selector


def _built(
    what: str,
    make: Callable[..., Made],
    parameters: Mapping[str, Parameter],
    selector: Selector,
) -> Made:
    """Make an object with the selector's parameters and check them, even if its class does not."""
    values = _values(what, parameters, selector)
    for name, parameter in parameters.items():
        if parameter.required and name not in values:
            raise DikbenchError(
                f"{what}: parameter {name!r} must be given; valid: "
                f"{selector.name}[{name}=...], {parameter.valid}"
            )
    try:
        made = make(**values)
        check_parameters(made)
    except MemoryError:
        raise
    except Exception as error:
        raise DikbenchError(f"{what}: {_reason(error)}") from error
    return made


def _values(what: str, parameters: Mapping[str, Parameter], selector: Selector) -> dict[str, Any]:
    """Convert the selector's texts to the types that the parameters declare."""
    values: dict[str, Any] = {}
    for name, text in selector.parameters.items():
        parameter = parameters.get(name)
        if parameter is None:
            offered = [other for other, known in parameters.items() if not known.hidden]
            raise unknown(f"parameter of {what}", name, offered)
        try:
            values[name] = msgspec.convert(text, parameter.type, strict=False)
        except (msgspec.ValidationError, TypeError):  # a TypeError: no text converts to it
            raise DikbenchError(
                f"{what}: {name}={text!r} is not valid; valid: {parameter.valid}"
            ) from None
    return values


def _reason(error: Exception) -> str:
    """Write an error in one line, with type and place unless it is a `DikbenchError`."""
    return str(error) if isinstance(error, DikbenchError) else in_words(error)
