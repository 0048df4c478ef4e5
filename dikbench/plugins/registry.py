"""Formulations and scenario families, found through entry points; selectors turned into objects.

A plug-in names a module in the entry-point group `dikbench.formulations` or `dikbench.scenarios`;
the module holds a table `FORMULATIONS` (name -> class) or `SCENARIOS` (name -> family).
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import inspect
import os.path
import sys
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass, is_dataclass, replace
from functools import cached_property, lru_cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal

import msgspec

from dikbench.errors import DikbenchError, unknown
from dikbench.problem.problem import Formulation
from dikbench.scenario.plant import PLANTS, Plant
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector, parse_selector

Kind = Literal["formulation", "scenario", "plant"]


@dataclass(frozen=True)
class Plugin:
    """A formulation or a scenario family as it was registered.

    Attributes:
        name: the name in the table.
        build: the class or function that is called with the parameters.
        file: the file that it comes from.
    """

    name: str
    build: Callable[..., Any]
    file: str

    @property
    def documented(self) -> Any:
        """The class or function that carries its docstring."""
        return _target(self.build)

    @property
    def summary(self) -> str:
        """The first line of its docstring."""
        return (inspect.getdoc(self.documented) or "").partition("\n")[0]

    @property
    def source(self) -> str:
        """The paragraph `Source: ...` of its docstring, on one line."""
        return self.paragraph("Source")

    def paragraph(self, title: str) -> str:
        """The paragraph `title: ...` of its docstring, on one line; empty where there is none."""
        _, _, text = (inspect.getdoc(self.documented) or "").partition(f"{title}: ")
        return " ".join(text.partition("\n\n")[0].split()).rstrip(".")

    @cached_property
    def parameters(self) -> Mapping[str, inspect.Parameter]:
        """Its parameters, with their defaults."""
        law = _preset(self.build)
        signature = inspect.signature(self.build if law is None else type(law))
        return {
            name: parameter if law is None else parameter.replace(default=getattr(law, name))
            for name, parameter in signature.parameters.items()
            if parameter.kind not in {parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD}
        }


@lru_cache
def plugins(kind: Kind) -> Mapping[str, Plugin]:
    """Every registered plug-in of a kind, by name.

    Raises:
        DikbenchError: if there is none (dikbench is not installed), a module has no table, or two
            plug-ins share a name.
    """
    group = f"dikbench.{kind}s"
    table_name = f"{kind.upper()}S"
    found: dict[str, Plugin] = {}
    for entry_point in importlib.metadata.entry_points(group=group):
        try:
            module = entry_point.load()
        except Exception as error:
            raise DikbenchError(
                f"plug-in {entry_point.name!r} of {group} ({entry_point.value}) cannot be imported:"
                f" {type(error).__name__}: {error}"
            ) from error
        file = getattr(module, "__file__", None) or repr(module)
        table = getattr(module, table_name, None)
        if not isinstance(table, Mapping):
            raise DikbenchError(
                f"plug-in {entry_point.name!r} of {group}: {file} holds no mapping {table_name}"
            )
        for name, build in table.items():
            plugin = _checked(kind, name, build, file)
            if name in found and _entry(found[name].build) is not _entry(plugin.build):
                raise DikbenchError(
                    f"two plug-ins are called {name!r}: {found[name].file} and {plugin.file}"
                )
            found[name] = plugin
    if not found:
        raise DikbenchError(
            f"no {kind}s are registered: dikbench is not installed here; "
            "run pip install -e . in its checkout"
        )
    return found


def _checked(kind: Kind, name: object, build: object, file: str) -> Plugin:
    if not isinstance(name, str) or not name or set(name) & set("[],= \t\n"):
        raise DikbenchError(f"{file}: {name!r} is not a name (no brackets, commas or spaces)")
    if kind == "formulation" and is_dataclass(build) and not isinstance(build, type):
        build = partial(replace, build)  # a law with its parameters set: they are the defaults
    if not callable(build):
        raise DikbenchError(f"{file}: {kind} {name!r} is not callable")
    target = _target(build)
    if kind == "formulation" and not callable(getattr(target, "velocity", None)):
        raise DikbenchError(f"{file}: formulation {name!r} has no method velocity(problem, solve)")
    try:
        own_file = inspect.getsourcefile(target) or file
    except TypeError:
        own_file = file
    return Plugin(name, build, own_file)


def make_formulation(text: str | Selector) -> Formulation:
    """Build a law from `name[parameter=value,...]` or `path/to/file.py:Class[...]`.

    Raises:
        DikbenchError: on an unknown name, file, class or parameter, or a value out of range.
    """
    selector = parse_selector(text)
    plugin = formulation_plugin(selector.name)
    formulation: Formulation = _build("formulation", plugin, selector, {})
    return formulation


def formulation_plugin(name: str) -> Plugin:
    """The plug-in behind a formulation's name or `path/to/file.py:Class`."""
    path, colon, class_name = name.rpartition(":")
    if colon and path.endswith(".py"):
        return _checked("formulation", class_name, _class_from_file(path, class_name), path)
    known = plugins("formulation")
    if name not in known:
        raise unknown("formulation", name, known, "(or give path/to/file.py:Class)")
    return known[name]


def make_scenario(text: str | Selector, seed: int = 0) -> Scenario:
    """Build the scenario of a selector and a seed; its certificate is asserted.

    Raises:
        DikbenchError: on an unknown family or parameter, a value out of range, or a certificate
            that does not hold.
    """
    selector = parse_selector(text)
    plugin = scenario_plugin(selector.name)
    if "seed" in selector.parameters:
        raise DikbenchError(f"scenario {str(text)!r}: the seed is not a parameter; use --seed")
    extra: dict[str, Any] = {"seed": seed} if "seed" in plugin.parameters else {}
    if seed and not extra:
        raise DikbenchError(f"scenario family {selector.name!r} takes no seed; valid: 0")
    scenario: Scenario = _build("scenario", plugin, selector, extra)
    if not isinstance(scenario, Scenario):
        raise DikbenchError(
            f"{plugin.file}: scenario {selector.name!r} returned {type(scenario).__name__}, "
            "not a Scenario"
        )
    scenario.certificate.check(str(text))
    return scenario


def make_plant(text: str | Selector) -> Plant:
    """Build a plant from `ideal[noise=...,delay=...]` or `saturating[...]`.

    Raises:
        DikbenchError: on an unknown name or parameter, or a value out of range.
    """
    selector = parse_selector(text)
    if selector.name not in PLANTS:
        raise unknown("plant", selector.name, PLANTS)
    plugin = Plugin(selector.name, PLANTS[selector.name], __file__)
    plant: Plant = _build("plant", plugin, selector, {})
    return plant


def scenario_parameters(text: str | Selector) -> Mapping[str, Any]:
    """The parameters of a scenario's selector with their values, defaults among them, but the seed.

    Raises:
        DikbenchError: on an unknown family or parameter, or a value of the wrong type.
    """
    selector = parse_selector(text)
    plugin = scenario_plugin(selector.name)
    if "seed" in selector.parameters:
        raise DikbenchError(f"scenario {str(text)!r}: the seed is not a parameter; use --seed")
    defaults = {name: parameter.default for name, parameter in plugin.parameters.items()}
    given = _values("scenario", plugin, selector)
    return {name: value for name, value in {**defaults, **given}.items() if name != "seed"}


def scenario_plugin(name: str) -> Plugin:
    """The plug-in behind a scenario family's name."""
    known = plugins("scenario")
    if name not in known:
        raise unknown("scenario", name, known)
    return known[name]


def _preset(build: Any) -> Any:
    """The law with its parameters set that a table holds in place of a class; else None."""
    return build.args[0] if isinstance(build, partial) and build.func is replace else None


def _entry(build: Any) -> Any:
    """What stood in the table."""
    law = _preset(build)
    return build if law is None else law


def _target(build: Any) -> Any:
    """The class or function behind a table's entry."""
    law = _preset(build)
    if law is not None:
        return type(law)
    return build.func if isinstance(build, partial) else build


def _build(kind: Kind, plugin: Plugin, selector: Selector, extra: Mapping[str, Any]) -> Any:
    """Call a plug-in with the selector's parameters."""
    values = {**extra, **_values(kind, plugin, selector)}
    missing = [
        name
        for name, parameter in plugin.parameters.items()
        if parameter.default is parameter.empty and name not in values
    ]
    if missing:
        raise DikbenchError(f"{kind} {plugin.name}: parameter {missing[0]!r} must be given")
    try:
        return plugin.build(**values)
    except (DikbenchError, MemoryError):
        raise
    except Exception as error:
        reason = f"{type(error).__name__}: {error}".partition("\n")[0]
        raise DikbenchError(f"{kind} {plugin.name} of {plugin.file}: {reason}") from error


def _values(kind: Kind, plugin: Plugin, selector: Selector) -> dict[str, Any]:
    """The selector's parameters, converted to the types that the plug-in declares."""
    parameters = plugin.parameters
    values: dict[str, Any] = {}
    for name, text in selector.parameters.items():
        if name not in parameters:
            raise unknown(f"parameter of {kind} {plugin.name}", name, set(parameters) - {"seed"})
        wanted = _type_of(plugin.documented, parameters[name])
        try:
            values[name] = msgspec.convert(text, wanted, strict=False)
        except (msgspec.ValidationError, TypeError) as error:  # a TypeError: no text can give it
            raise DikbenchError(
                f"{kind} {plugin.name}: {name}={text!r} is not valid: {_reason(error, wanted)}"
            ) from None
    return values


def _type_of(target: Any, parameter: inspect.Parameter) -> Any:
    """The type that a parameter declares; where it declares none that is known here, its default's.

    Each is resolved by itself: one name that is imported for type checkers only must not turn the
    numbers beside it into texts.
    """
    alone = SimpleNamespace(__annotations__={parameter.name: parameter.annotation})
    for owner in getattr(target, "__mro__", (target,)):
        names = getattr(sys.modules.get(owner.__module__), "__dict__", {})
        try:
            found = typing.get_type_hints(alone, names)[parameter.name]
        except (NameError, AttributeError, TypeError, SyntaxError):
            continue
        if found is not parameter.empty:
            return found
    number: dict[type, Any] = {bool: bool, int: int | float, float: float}
    return number.get(type(parameter.default), str)


def _reason(error: Exception, wanted: Any) -> str:
    choices = typing.get_args(wanted) if typing.get_origin(wanted) is Literal else ()
    return "valid: " + ", ".join(map(str, choices)) if choices else str(error)


@lru_cache
def _class_from_file(path: str, class_name: str) -> type:
    """Import a file that the user named on the command line and take a class out of it."""
    file = Path(path)
    if not os.path.isfile(path):  # unlike Path.is_file, False for a name that is too long
        raise DikbenchError(f"formulation file not found: {path}")
    spec = importlib.util.spec_from_file_location(f"dikbench_user_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses and pickle look it up there
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise DikbenchError(
            f"formulation file {path} cannot be imported: {type(error).__name__}: {error}"
        ) from error
    found = getattr(module, class_name, None)
    if not isinstance(found, type):
        classes = [name for name, value in vars(module).items() if isinstance(value, type)]
        raise unknown("class", class_name, classes, f"in {path}")
    return found
