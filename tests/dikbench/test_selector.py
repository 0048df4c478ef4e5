"""Selectors: their forms, their errors, and nothing but `DikbenchError` from any text."""

from __future__ import annotations

import contextlib
import pickle

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.selector import Selector, alternatives, parse_selector, quoted
from dikbench.solvers.catalogue.back_ends import BACK_ENDS, parse_solver

# Texts that look like selectors, so that the fuzz gets past the first check.
pieces = st.sampled_from(
    "dls pinv qp near-miss reach osqp [ ] = , : .py / damping after miss eps_abs nan -1 1e999 0.1 "
    "clip null \x00".split(" ")
)
texts = st.one_of(st.text(max_size=40), st.lists(pieces, max_size=9).map("".join))

names = st.text(
    st.characters(
        blacklist_characters="[]'\"", blacklist_categories=("Cs", "Zs", "Zl", "Zp", "Cc")
    ),
    min_size=1,
    max_size=12,
)
words = st.text(
    st.characters(whitelist_categories=("Lu", "Ll", "Nd"), whitelist_characters="_-.+/:"),
    min_size=1,
    max_size=12,
)


@pytest.mark.parametrize(
    ("text", "name", "parameters", "canonical"),
    [
        ("pinv", "pinv", {}, "pinv"),
        ("  pinv  ", "pinv", {}, "pinv"),
        ("pinv[]", "pinv", {}, "pinv"),
        ("pinv[ ]", "pinv", {}, "pinv"),
        ("pinv[after=clip]", "pinv", {"after": "clip"}, "pinv[after=clip]"),
        ("a[y=0.050,x=ur5]", "a", {"y": "0.050", "x": "ur5"}, "a[y=0.050,x=ur5]"),
        ("a [ x = 1 , y = two words ]", "a", {"x": "1", "y": "two words"}, "a[x=1,y=two words]"),
        ("a[x=b=c]", "a", {"x": "b=c"}, "a[x=b=c]"),
        ("my laws/f.py:F[gain=2]", "my laws/f.py:F", {"gain": "2"}, "my laws/f.py:F[gain=2]"),
    ],
)
def test_forms_of_a_selector(
    text: str, name: str, parameters: dict[str, str], canonical: str
) -> None:
    """A name, or a name and parameters in brackets; white space around the parts is nothing."""
    selector = parse_selector(text)
    assert selector.name == name
    assert dict(selector.parameters) == parameters
    assert str(selector) == canonical
    assert parse_selector(canonical) == parse_selector(selector) == selector


@pytest.mark.parametrize(
    "text",
    ["", "   ", "[a=1]", "pinv[", "pinv]", "pinv[a=1", "pinv[a=1]]", "pinv[a=[1]]", "pinv[a=1]x"],
)
def test_texts_that_are_no_selectors(text: str) -> None:
    """The message shows the text and the form that it should have."""
    with pytest.raises(DikbenchError) as caught:
        parse_selector(text)
    assert str(caught.value) == (
        f"selector {text!r} is not of the form name or name[parameter=value,...]"
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a[x]", "'x' is not parameter=value"),
        ("a[x=]", "'x=' is not parameter=value"),
        ("a[=1]", "'=1' is not parameter=value"),
        ("a[x=1,]", "'' is not parameter=value"),
        ("a[,x=1]", "'' is not parameter=value"),
        ("a[x=1,x=2]", "parameter 'x' is given twice"),
    ],
)
def test_wrong_parameters(text: str, message: str) -> None:
    """The message shows the selector and the part of it that is wrong."""
    with pytest.raises(DikbenchError) as caught:
        parse_selector(text)
    assert str(caught.value) == f"selector {text!r}: {message}"


@given(name=names, parameters=st.dictionaries(words, words, max_size=4))
def test_a_selector_that_is_put_together_comes_apart_again(
    name: str, parameters: dict[str, str]
) -> None:
    """Name and parameters, in their order, for any words without brackets, commas or blanks."""
    inside = ",".join(f"{key}={value}" for key, value in parameters.items())
    text = f"{name}[{inside}]"
    selector = parse_selector(text)
    assert selector == Selector(name, parameters)
    assert list(selector.parameters) == list(parameters)
    assert str(selector) == (text if parameters else name)
    backwards = Selector(name, dict(reversed(parameters.items())))
    assert (backwards, hash(backwards)) == (selector, hash(selector))
    assert pickle.loads(pickle.dumps(selector)) == selector


def test_a_selector_cannot_be_changed() -> None:
    """It stands in a study and in the identity of a trial."""
    selector = parse_selector("a[x=1]")
    with pytest.raises(TypeError):
        selector.parameters["x"] = "2"  # type: ignore[index]


@settings(deadline=None, max_examples=400)
@given(text=texts)
def test_any_text_parses_or_is_an_error_of_ours(text: str) -> None:
    """Never anything but DikbenchError."""
    with contextlib.suppress(DikbenchError):
        parse_selector(text)


@settings(deadline=None, max_examples=200)
@given(text=texts)
def test_any_text_makes_a_law_or_is_an_error_of_ours(text: str) -> None:
    """Never anything but DikbenchError, for formulations and for solvers."""
    with contextlib.suppress(DikbenchError):
        make_formulation(text)
    with contextlib.suppress(DikbenchError):
        parse_solver(text)


@settings(deadline=None, max_examples=200)
@given(
    law=st.sampled_from(
        "dls[damping qp[position_gain pinv[rank_tolerance pinv[after qp[braking qp[log_derivative "
        "lp-alpha[regularization no/file.py:Law[a".split()
    ),
    value=st.one_of(st.text(max_size=20), st.floats().map(repr), st.integers().map(str)),
)
def test_any_value_of_a_parameter_makes_a_law_or_is_an_error_of_ours(law: str, value: str) -> None:
    """Never anything but DikbenchError, for every type of parameter."""
    with contextlib.suppress(DikbenchError):
        make_formulation(f"{law}={value}]")


@settings(deadline=None, max_examples=200)
@given(
    setting=st.sampled_from([f"{n}[{key}" for n, b in BACK_ENDS.items() for key in b.settings]),
    value=st.one_of(st.text(max_size=20), st.floats().map(repr), st.integers().map(str)),
)
def test_any_value_of_a_setting_makes_a_solver_or_is_an_error_of_ours(
    setting: str, value: str
) -> None:
    """Never anything but DikbenchError."""
    with contextlib.suppress(DikbenchError):
        parse_solver(f"{setting}={value}]")


@settings(deadline=None, max_examples=100)
@given(text=st.text(max_size=30), seed=st.integers(-5, 5))
def test_any_text_makes_a_scenario_or_is_an_error_of_ours(text: str, seed: int) -> None:
    """Never anything but DikbenchError, as a family's name and as a parameter's value."""
    for selector in (text, f"near-miss[miss={text}]", f"reach[robot={text}]"):
        with contextlib.suppress(DikbenchError):
            make_scenario(selector, seed)


@given(
    name=st.text(min_size=1).filter(lambda text: not {"'", '"'} <= set(text)),
    value=st.text(min_size=1).filter(lambda text: not {"'", '"'} <= set(text)),
)
@example(name="my arm, left [v2].py:Law", value="a=1 b|c, d")
@example(name="o'brien.py:Law", value="o'brien.urdf")
def test_any_name_and_value_can_be_selected_in_quotes(name: str, value: str) -> None:
    """Such as paths with commas, brackets, bars and blanks; in a list each value has its own."""
    selector = Selector(name, {"file": value})
    assert parse_selector(str(selector)) == selector
    assert alternatives(str(selector)) == [selector]
    inside = quoted(value)
    assert alternatives(f"a[file={inside}|other{value == 'other'}]") == [
        Selector("a", {"file": value}),
        Selector("a", {"file": f"other{value == 'other'}"}),
    ]
