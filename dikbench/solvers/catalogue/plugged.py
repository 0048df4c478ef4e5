"""Solvers of other authors, described as those that come with dikbench are."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import is_dataclass
from types import MappingProxyType
from typing import Any, Final, get_args

import msgspec

from dikbench.errors import DikbenchError, in_words, unknown
from dikbench.parameters import check_parameters, parameters_of
from dikbench.programs.quadratic_program import ProgramKind
from dikbench.solvers.catalogue.back_end import BackEnd
from dikbench.solvers.catalogue.library import SolverLibrary
from dikbench.user_code import Named

RESERVED: Final = ("interface", "preset", "then")
"""What selectors of solvers have for themselves."""


def misfit(value: Any) -> str:
    """Say why something is no solver, to follow its name; an empty text where it is one."""
    if not isinstance(value, type) or not issubclass(value, SolverLibrary):
        return "is no class that is derived from dikbench.solvers.SolverLibrary"
    if inspect.isabstract(value):
        return "has no method solve(program)"
    try:
        parameters = parameters_of(value)
    except DikbenchError as error:
        return f"is not declared properly: {error}"
    assert is_dataclass(value)
    for name in RESERVED:
        if name in parameters:
            return f"has a setting {name!r}, which selectors use themselves; valid: another name"
    strange = set(value.programs) - {"qp", "lp"}
    if strange or not value.programs:
        return f"declares programs = {set(value.programs)}; valid: of {get_args(ProgramKind)[:2]}"
    return ""


def back_end_of(found: Named) -> BackEnd:
    """Describe a solver of another author."""
    library: type[SolverLibrary] = found.value
    parameters = parameters_of(library)
    return BackEnd(
        summary=(inspect.getdoc(library) or "").partition("\n")[0].rstrip("."),
        package=library.package,
        programs=frozenset(library.programs),
        interfaces=("cold", "warm") if library.has_workspace() else ("cold",),
        settings={name: parameter.type for name, parameter in parameters.items()},
        no_lp="" if "lp" in library.programs else "it declares quadratic programs alone",
        own_defaults=MappingProxyType({}),
        library=library,
        found=found,
    )


def built_library(
    back_end: BackEnd, name: str, tolerance: float | None, given: Mapping[str, str]
) -> SolverLibrary:
    """Build a solver of another author with its settings.

    Args:
        back_end: its description.
        name: its name.
        tolerance: what its preset asks for; None: nothing.
        given: settings as texts, which replace those of the preset.

    Raises:
        DikbenchError: on an unknown setting, a value that is not valid, or a preset that fails.
    """
    library = back_end.library
    assert library is not None
    parameters, values = parameters_of(library), dict[str, Any]()
    try:
        if tolerance is not None:
            values |= library.preset(tolerance)
        for key in values:
            if key not in parameters:
                raise unknown("setting in preset()", key, parameters)
        for key, text in given.items():
            if key not in parameters:
                raise unknown("setting", key, (*RESERVED, *parameters))
            try:
                values[key] = msgspec.convert(text, parameters[key].type, strict=False)
            except (msgspec.ValidationError, TypeError):
                valid = parameters[key].valid
                raise DikbenchError(f"{key}={text!r} is not valid; valid: {valid}") from None
        made = library(**values)
        check_parameters(made)
    except MemoryError:
        raise
    except Exception as error:
        said = str(error) if isinstance(error, DikbenchError) else in_words(error)
        raise DikbenchError(f"solver {name}: {said}") from error
    return made
