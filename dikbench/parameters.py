"""The parameters of plug-ins: fields of a frozen dataclass, with their ranges in the annotations.

    damping: Annotated[float, Range(0.0), Drawn(1e-3, 0.3, log=True)] = 0.05

The range is declared once: the check, the help, tuning and the drawing of instances read it.
"""

from __future__ import annotations

import dataclasses
import inspect
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import inf, isfinite, isnan, nan
from numbers import Real
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union

from dikbench.annotations import declared_types, marker_in, type_in_words
from dikbench.errors import DikbenchError

REQUIRED: Final = dataclasses.MISSING
"""Stands for the default of a parameter that must be given."""


@dataclass(frozen=True)
class Range:
    """The finite numbers, from `low` to `high`, that are valid for a parameter.

    Attributes:
        low, high: the least and the largest number.
        unit: their unit ("rad/s"), for labels and errors.
        above, below: exclusive bounds.
        also: single numbers that are valid in addition.
    """

    low: float = -inf
    high: float = inf
    unit: str = ""
    above: float = -inf
    below: float = inf
    also: tuple[float, ...] = ()

    def holds(self, value: Any) -> bool:
        """Say whether a value is a number of this range (NaN and infinity are in none)."""
        if not isinstance(value, Real):
            return False
        number = float(value)
        inside = self.low <= number <= self.high and self.above < number < self.below
        return number in self.also or (isfinite(number) and inside)

    def check(self, name: str, value: Any) -> None:
        """Check the value of a parameter.

        Raises:
            DikbenchError: if it is outside; the message names the parameter and the range.
        """
        if not self.holds(value):
            raise DikbenchError(f"{name}={value} must be {self}")

    def __str__(self) -> str:
        """Write the range in words, with its unit."""
        low = f"at least {self.low:g}" if isfinite(self.low) else ""
        low = f"above {self.above:g}" if self.above >= self.low and isfinite(self.above) else low
        high = f"at most {self.high:g}" if isfinite(self.high) else ""
        high = f"below {self.below:g}" if self.below <= self.high and isfinite(self.below) else high
        if low.startswith("at least") and high.startswith("at most"):
            words = f"{self.low:g} to {self.high:g}"
        elif low and high:
            words = f"{low} and {high}"
        else:
            words = " and ".join(part for part in ("finite", low, high) if part)
        alone = "".join(f"{number:g} or " for number in self.also)
        return f"{alone}{words}{f' [{self.unit}]' if self.unit else ''}"


@dataclass(frozen=True)
class Drawn:
    """The range in which a family's parameter is drawn, or a formulation's is tuned.

    Attributes:
        low, high: finite bounds of a number; a choice among values and a bool have none.
        log: whether the logarithm is drawn uniformly.
    """

    low: float = nan
    high: float = nan
    log: bool = False

    def __post_init__(self) -> None:
        """Check the bounds.

        Raises:
            DikbenchError: if they are not finite with low < high, or not positive where `log` is
                set.
        """
        if isnan(self.low) and isnan(self.high) and not self.log:
            return
        if not (isfinite(self.low) and isfinite(self.high) and self.low < self.high):
            raise DikbenchError(
                f"Drawn({self.low}, {self.high}): bounds must be finite, low < high"
            )
        if self.log and self.low <= 0:
            raise DikbenchError(f"Drawn({self.low}, {self.high}): a logarithm needs low > 0")

    def __str__(self) -> str:
        """Write the bounds in words."""
        if isnan(self.low):
            return "any of these"
        return f"{self.low:g} to {self.high:g}{', logarithmic' if self.log else ''}"


@dataclass(frozen=True)
class Parameters:
    """The base of families, formulations and plants, whose parameters are checked when made.

    A subclass is a frozen dataclass; its `check` checks conditions on several parameters.
    """

    def __init_subclass__(cls, **options: Any) -> None:
        """Refuse a class body that Python reads differently from what its author meant.

        Raises:
            DikbenchError: if a parameter has no type or hides a class variable of a base, or the
                class has a `__post_init__` of its own.
        """
        super().__init_subclass__(**options)
        _check_body(cls)

    def __post_init__(self) -> None:
        """Check each parameter, then the conditions on several of them."""
        check_parameters(self)
        self.check()

    def check(self) -> None:
        """Check conditions on several parameters.

        Raises:
            DikbenchError: if a condition does not hold.
        """


@dataclass(frozen=True)
class Parameter:
    """A parameter of a plug-in, as its class declares it.

    Attributes:
        name: of the field.
        type: its type, without ranges.
        default: its default; `REQUIRED` where it must be given.
        range: the valid numbers; None where the class declares no range.
        drawn: the range in which it is drawn or tuned; None where it is not.
    """

    name: str
    type: Any
    default: Any = REQUIRED
    range: Range | None = None
    drawn: Drawn | None = None

    @property
    def required(self) -> bool:
        """Whether it must be given."""
        return self.default is REQUIRED

    @property
    def choices(self) -> tuple[Any, ...]:
        """The values of a `Literal`; empty for any other type."""
        if self.type in (None, NoneType):
            return (None,)
        return typing.get_args(self.type) if typing.get_origin(self.type) is Literal else ()

    @property
    def numeric(self) -> bool:
        """Whether it is a number, or may be one; what may be a text too is checked by its class."""
        union = typing.get_origin(self.type) in (Union, UnionType)
        kinds = typing.get_args(self.type) if union else (self.type,)
        return any(part in (int, float) for part in kinds) and str not in kinds

    @property
    def hidden(self) -> bool:
        """Whether it has one value only, so that lists leave it out."""
        return len(self.choices) == 1

    @property
    def valid(self) -> str:
        """The valid values, in words."""
        if self.range is not None:
            return f"{type_in_words(self.type)}, {self.range}"
        if self.choices:
            return ", ".join(map(str, self.choices))
        return type_in_words(self.type)

    def check(self, value: Any) -> None:
        """Check a value.

        Raises:
            DikbenchError: if it is not valid; the message says which values are.
        """
        if value is None and NoneType in typing.get_args(self.type):
            return
        if self.range is not None:
            self.range.check(self.name, value)
        elif self.choices and value not in self.choices:
            raise DikbenchError(f"{self.name}={value!r} must be one of: {self.valid}")
        elif isinstance(value, float) and isnan(value):
            raise DikbenchError(f"{self.name}={value} must be a number")


def check_parameters(plugin: object) -> None:
    """Check each field of a dataclass against the range in its annotation.

    Raises:
        DikbenchError: for the first value that is not valid, or a class that declares its
            parameters wrongly.
    """
    kind: Any = type(plugin)
    for name, parameter in parameters_of(kind).items():
        parameter.check(getattr(plugin, name))


@lru_cache(maxsize=1024)
def parameters_of(plugin: type) -> Mapping[str, Parameter]:
    """Read the parameters of a dataclass, by name; any other class has none.

    Raises:
        DikbenchError: if the decorator is missing, a type cannot be found, or a default or a bound
            of `Drawn` is outside the range.
    """
    if issubclass(plugin, Parameters) and "__dataclass_params__" not in vars(plugin):
        raise DikbenchError(f"class {plugin.__qualname__}: write @dataclass(frozen=True) above it")
    if not dataclasses.is_dataclass(plugin):
        return MappingProxyType({})
    found = {field.name: _read(plugin, field) for field in dataclasses.fields(plugin) if field.init}
    return MappingProxyType(found)


def _read(plugin: type, field: dataclasses.Field[Any]) -> Parameter:
    """Read one parameter and check its declaration."""
    default = field.default if field.default_factory is REQUIRED else field.default_factory()
    hints = [hint for hint in declared_types(plugin, field.name) if hint is not None]
    if hints:
        kind = hints[0]
        kind = typing.get_args(kind)[0] if typing.get_origin(kind) is Annotated else kind
    elif issubclass(plugin, Parameters):
        raise DikbenchError(
            f"class {plugin.__qualname__}: the type of {field.name}, {field.type}, cannot be "
            "found; import it outside of TYPE_CHECKING"
        )
    else:
        number: dict[type, Any] = {bool: bool, int: int | float, float: float}
        kind = number.get(type(default), str)
    parameter = Parameter(field.name, kind, default, None, marker_in(hints, Drawn))
    if parameter.numeric:
        parameter = dataclasses.replace(parameter, range=marker_in(hints, Range))
    problem = "its default"
    try:
        if not parameter.required:
            parameter.check(default)
        problem = "Drawn:"
        _check_drawn(parameter)
    except DikbenchError as error:
        raise DikbenchError(f"class {plugin.__qualname__}: {problem} {error}") from None
    return parameter


def _check_drawn(parameter: Parameter) -> None:
    """Check that a parameter can be drawn as its class declares it.

    Raises:
        DikbenchError: if a bound is outside the range, what is no number has bounds, or there is
            nothing to draw from.
    """
    drawn, name = parameter.drawn, parameter.name
    if drawn is None:
        return
    if parameter.numeric:
        for bound in (drawn.low, drawn.high):
            parameter.check(bound)
    elif not (parameter.choices or parameter.type is bool):
        raise DikbenchError(
            f"{name} is {parameter.valid}; valid: a number, a Literal or a bool, or no Drawn"
        )
    elif not isnan(drawn.low):
        raise DikbenchError(f"{name} is {parameter.valid}, without bounds; valid: Drawn()")


def _check_body(cls: type) -> None:
    """Check the own body of a class of parameters (see `__init_subclass__`)."""
    own = inspect.get_annotations(cls)
    where = f"class {cls.__qualname__}"
    if "__post_init__" in vars(cls):
        raise DikbenchError(
            f"{where}: check what spans several parameters in check(self), not in "
            "__post_init__, which would replace the check of the ranges"
        )
    constants = {
        name
        for base in cls.__mro__[1:]
        for name, hint in inspect.get_annotations(base).items()
        if "ClassVar" in str(hint)
    }
    inherited = {
        field.name
        for base in cls.__mro__[1:]
        if dataclasses.is_dataclass(base)
        for field in dataclasses.fields(base)
    }
    for name, hint in own.items():
        if name in constants and "ClassVar" not in str(hint):
            raise DikbenchError(
                f"{where}: {name} is a class variable, no parameter; write {name} = ... without a "
                "type"
            )
    for name, value in vars(cls).items():
        untyped = name not in own and name not in constants and not name.startswith("_")
        if untyped and (name in inherited or isinstance(value, bool | int | float)):
            raise DikbenchError(
                f"{where}: {name} = {value!r} has no type, so that Python makes it no parameter; "
                f"write {name}: {type(value).__name__} = {value!r}"
            )
