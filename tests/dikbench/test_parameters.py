"""Ranges in annotations: what they hold, what they say, and what is refused of a class."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from math import inf, isfinite, nan
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.errors import DikbenchError
from dikbench.parameters import Drawn, Parameters, Range, check_parameters, parameters_of
from dikbench.plugins.finding import plugins
from dikbench.scenario import Family

if TYPE_CHECKING:
    from fractions import Fraction

numbers = st.floats(allow_nan=False, allow_infinity=False)


@dataclass(frozen=True)
class Filter(Parameters):
    """A class as an author writes it."""

    gain: Annotated[float, Range(0.1, 3.0, "1/s"), Drawn(0.3, 2.0, log=True)] = 0.7
    side: Annotated[Literal["left", "right"], Drawn()] = "left"
    bound: Annotated[float | None, Range(0.0)] = None
    share: float = 0.5
    kind: ClassVar[str] = "linear"


@dataclass(frozen=True)
class Slower(Filter):
    """Another default, and a check of two parameters."""

    gain: float = 0.2

    def check(self) -> None:
        """Check that the bound is above the gain."""
        if self.bound is not None and self.bound < self.gain:
            raise DikbenchError(f"bound={self.bound} must be at least gain={self.gain}")


# --- ranges


@given(numbers, numbers, numbers)
def test_a_closed_range_holds_its_ends_and_what_is_between(a: float, b: float, x: float) -> None:
    """And nothing else."""
    low, high = min(a, b), max(a, b)
    closed = Range(low, high)
    assert closed.holds(low)
    assert closed.holds(high)
    assert closed.holds(x) == (low <= x <= high)


@given(numbers, numbers, numbers)
def test_an_open_range_holds_neither_end(a: float, b: float, x: float) -> None:
    """But all between them, and the numbers that are named besides."""
    low, high = min(a, b), max(a, b)
    between = Range(above=low, below=high)
    assert not between.holds(low)
    assert not between.holds(high)
    assert between.holds(x) == (low < x < high)
    assert Range(above=low, below=high, also=(low,)).holds(low)


@given(numbers)
def test_every_range_is_of_finite_numbers(x: float) -> None:
    """The widest one holds any of them, of any numeric type, and neither NaN nor infinity."""
    assert Range().holds(x)
    assert Range().holds(np.float64(x))
    assert Range().holds(int(x)) == isfinite(float(int(x)))
    for value in (nan, inf, -inf, "1", None):
        assert not Range().holds(value)


@pytest.mark.parametrize(
    ("wanted", "text"),
    [
        (Range(), "finite"),
        (Range(0.0), "finite and at least 0"),
        (Range(above=0.0, unit="s"), "finite and above 0 [s]"),
        (Range(high=2.0), "finite and at most 2"),
        (Range(0.0, below=1.0), "at least 0 and below 1"),
        (Range(above=0.0, high=1.0), "above 0 and at most 1"),
        (Range(above=0.0, below=1.0), "above 0 and below 1"),
        (Range(1, 5), "1 to 5"),
        (Range(0.001, 0.2, "m; rad", also=(0.0,)), "0 or 0.001 to 0.2 [m; rad]"),
    ],
)
def test_ranges_in_words(wanted: Range, text: str) -> None:
    """As errors and `dikbench show` print them."""
    assert str(wanted) == text


@given(numbers.filter(lambda x: x < 1), numbers.filter(lambda x: x > 2))
def test_a_check_names_parameter_value_and_range(low: float, high: float) -> None:
    """In one line; what is inside passes."""
    Range(1, 2).check("x", 1.5)
    for value in (low, high):
        with pytest.raises(DikbenchError) as caught:
            Range(1, 2, "rad").check("x", value)
        assert str(caught.value) == f"x={value} must be 1 to 2 [rad]"


@pytest.mark.parametrize(
    ("low", "high", "log"),
    [(0.0, inf, False), (2.0, 1.0, False), (1.0, 1.0, False), (0.0, 1.0, True), (nan, 1.0, False)],
)
def test_drawn_bounds_that_are_no_interval_are_refused(low: float, high: float, log: bool) -> None:
    """Infinite, in the wrong order, empty, or without a logarithm."""
    with pytest.raises(DikbenchError, match=r"Drawn\("):
        Drawn(low, high, log)


# --- the parameters of a class


def test_what_a_class_declares() -> None:
    """Types without their markers, ranges, bounds, defaults; a class variable is no parameter."""
    found = parameters_of(Filter)
    assert list(found) == ["gain", "side", "bound", "share"]
    gain = found["gain"]
    assert (gain.type, gain.default, gain.required) == (float, 0.7, False)
    assert gain.range == Range(0.1, 3.0, "1/s")
    assert gain.drawn == Drawn(0.3, 2.0, log=True)
    assert gain.valid == "a number, 0.1 to 3 [1/s]"
    assert (found["side"].choices, found["side"].valid) == (("left", "right"), "left, right")
    assert not found["side"].hidden
    assert found["share"].range is None


def test_a_new_default_keeps_the_range_of_the_base() -> None:
    """`gain: float = 0.2` in a subclass, with or without the markers again."""
    assert parameters_of(Slower)["gain"].range == Range(0.1, 3.0, "1/s")
    assert Slower().gain == 0.2
    with pytest.raises(DikbenchError, match=r"^gain=5 must be 0\.1 to 3 \[1/s\]$"):
        Slower(gain=5)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"gain": 0.0}, "gain=0.0 must be 0.1 to 3 [1/s]"),
        ({"gain": nan}, "gain=nan must be 0.1 to 3 [1/s]"),
        ({"gain": "1"}, "gain=1 must be 0.1 to 3 [1/s]"),
        ({"gain": None}, "gain=None must be 0.1 to 3 [1/s]"),
        ({"bound": -1.0}, "bound=-1.0 must be finite and at least 0"),
        ({"side": "up"}, "side='up' must be one of: left, right"),
        ({"share": nan}, "share=nan must be a number"),
    ],
)
def test_values_that_are_refused(values: dict[str, Any], message: str) -> None:
    """When the object is made, and when a field of it is replaced."""
    made = Filter()
    with pytest.raises(DikbenchError) as caught:
        Filter(**values)
    assert str(caught.value) == message
    with pytest.raises(DikbenchError) as caught:
        dataclasses.replace(made, **values)
    assert str(caught.value) == message


def test_what_spans_several_parameters_is_checked_after_each_by_itself() -> None:
    """`check` is called when the object is made."""
    assert Slower(bound=0.3).bound == 0.3
    with pytest.raises(DikbenchError, match=r"bound=0\.1 must be at least gain=0\.2"):
        Slower(bound=0.1)
    with pytest.raises(DikbenchError, match="bound=-1 must be finite"):
        Slower(bound=-1)


def test_a_plain_dataclass_can_be_checked_too() -> None:
    """Of a third party, without the base; a class that is no dataclass has no parameters."""
    plain = dataclasses.make_dataclass(
        "Plain", [("gain", Annotated[float, Range(0.0)], 1.0), ("share", float, 0.5)], frozen=True
    )
    check_parameters(plain())
    with pytest.raises(DikbenchError, match="gain=-1 must be finite and at least 0"):
        check_parameters(plain(gain=-1))
    assert dict(parameters_of(int)) == {}


# --- what is refused of a class


def test_a_parameter_without_a_type_is_refused() -> None:
    """Python makes it no field: the value would be the base's."""
    with pytest.raises(DikbenchError, match=r"Mine: gain = 0\.3 has no type.*gain: float = 0\.3"):

        @dataclass(frozen=True)
        class Mine(Filter):
            gain = 0.3

    with pytest.raises(DikbenchError, match=r"Other: speed = 2 has no type"):

        @dataclass(frozen=True)
        class Other(Filter):
            speed = 2


def test_a_missing_decorator_is_refused() -> None:
    """The fields of the body would be class variables."""

    class Mine(Filter):
        speed: float = 2.0

    for use in (Mine, lambda: parameters_of(Mine)):
        with pytest.raises(DikbenchError, match=r"Mine: write @dataclass\(frozen=True\) above it"):
            use()


def test_a_type_on_a_class_variable_is_refused() -> None:
    """It would become a parameter; without a type it is set."""
    with pytest.raises(DikbenchError, match="Mine: kind is a class variable, no parameter"):
        type("Mine", (Filter,), {"__annotations__": {"kind": "str"}, "kind": "cubic"})

    @dataclass(frozen=True)
    class Cubic(Filter):
        kind = "cubic"

    assert (Cubic.kind, Filter.kind) == ("cubic", "linear")
    assert "kind" not in parameters_of(Cubic)


def test_an_own_post_init_is_refused() -> None:
    """It would replace the check of the ranges."""
    with pytest.raises(DikbenchError, match=r"Mine: check what spans .* in check\(self\)"):

        @dataclass(frozen=True)
        class Mine(Filter):
            def __post_init__(self) -> None: ...


def test_a_default_outside_its_range_is_refused() -> None:
    """Also where the range is the base's."""

    @dataclass(frozen=True)
    class Mine(Filter):
        gain: float = 7.0

    with pytest.raises(DikbenchError, match=r"Mine: its default gain=7\.0 must be 0\.1"):
        Mine(gain=1.0)


@dataclass(frozen=True)
class Wide(Parameters):
    """Drawn from where it may not be."""

    gain: Annotated[float, Range(0.0, 1.0), Drawn(0.5, 2.0)] = 0.5


@dataclass(frozen=True)
class Boundless(Parameters):
    """Drawn from nowhere."""

    gain: Annotated[float, Drawn()] = 0.5


def test_drawn_bounds_outside_the_range_are_refused() -> None:
    """And a number that is drawn without bounds."""
    with pytest.raises(DikbenchError, match=r"Wide: Drawn: gain=2\.0 must be 0 to 1"):
        Wide()
    with pytest.raises(DikbenchError, match=r"Boundless: Drawn: gain=nan must be a number"):
        Boundless()


@pytest.mark.parametrize(
    ("kind", "drawn", "told"),
    [
        (str, Drawn(), "value is a text; valid: a number, a Literal or a bool"),
        (str | None, Drawn(0.0, 1.0), "value is a text or none; valid: a number"),
        (bool, Drawn(0.0, 1.0), r"value is true or false, without bounds; valid: Drawn\(\)"),
        (Literal["a", "b"], Drawn(1.0, 2.0), "value is a, b, without bounds"),
    ],
)
def test_what_cannot_be_drawn_is_refused_where_it_is_declared(
    kind: Any, drawn: Drawn, told: str
) -> None:
    """In one line that says what can be."""
    made = dataclasses.make_dataclass("Made", [("value", Annotated[kind, drawn])], frozen=True)
    with pytest.raises(DikbenchError, match=f"class Made: Drawn: {told}") as caught:
        parameters_of(made)
    assert "\n" not in str(caught.value)


@dataclass(frozen=True)
class Hidden(Parameters):
    """A type that is there for type checkers only."""

    share: Fraction | float = 0.5


def test_a_type_that_cannot_be_found_is_refused() -> None:
    """No text could be turned into it, no range be read."""
    with pytest.raises(DikbenchError, match=r"Hidden: the type of share, .* outside of TYPE_CHECK"):
        Hidden()


# --- what is registered


@pytest.mark.parametrize("kind", ["formulation", "scenario"])
def test_every_number_of_a_plugin_has_a_range_or_is_whole(kind: str) -> None:
    """No parameter of ours takes infinity by oversight; the markers are found in every class."""
    for plugin in plugins(kind).values():
        assert issubclass(plugin.factory, Parameters), plugin.name
        for parameter in plugin.parameters.values():
            assert parameter.range is not None or parameter.type not in (int, float)


def test_what_families_declare_for_figures_are_numbers_of_theirs() -> None:
    """Swept parameters and the axes of a grid."""
    grids = 0
    for plugin in plugins("scenario").values():
        assert issubclass(plugin.factory, Family)
        for name in plugin.factory.grid or ():
            assert plugin.parameters[name].range is not None
        grids += plugin.factory.grid is not None
    assert grids == 1


def test_every_family_can_be_drawn() -> None:
    """At least one parameter of each has bounds, but for the one that reads a file."""
    without = {
        name
        for name, plugin in plugins("scenario").items()
        if not any(parameter.drawn for parameter in plugin.parameters.values())
    }
    assert without == {"csv"}
