"""Formulations, scenario families and plants, found through entry points or in a file.

An entry of a table `FORMULATIONS`, `SCENARIOS` or `PLANTS` (see `dikbench.user_code`) is a class,
an instance of a class (whose values are then the defaults), or a `functools.partial` of one. A
module of formulations may have a table `PEERS` as well, of other libraries as formulations: they
are found by name, and are not among "all formulations", which do not depend on what is installed.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property, lru_cache, partial
from types import MappingProxyType
from typing import Any, Final, Literal

from dikbench.errors import DikbenchError, unknown
from dikbench.parameters import Parameter, parameters_of
from dikbench.scenario.family import Family
from dikbench.scenario.plant import PLANTS, Plant
from dikbench.selector import TUNED
from dikbench.user_code import Named, entries_of, in_file, named_in_file

__all__ = [
    "Kind",
    "Plugin",
    "Table",
    "formulation_plugin",
    "formulations_and_peers",
    "in_file",
    "plant_plugin",
    "plugins",
    "scenario_plugin",
]

Kind = Literal["formulation", "scenario", "plant"]
Table = Literal["formulation", "scenario", "peer", "plant"]

RESERVED: Final[Mapping[Kind, tuple[str, str]]] = MappingProxyType(
    {
        "formulation": (TUNED, f"for name[{TUNED}] selects the tuned parameters"),
        "scenario": ("seed", "for --seed selects it"),
    }
)
"""The word that selectors of a kind have for themselves, and what it does."""


@dataclass(frozen=True)
class Plugin:
    """A formulation, a scenario family or a plant as it was registered.

    Attributes:
        name: the name in the table.
        factory: the class with the docstring and the parameters.
        file: the file of the class.
        defaults: values that replace the defaults of the class.
    """

    name: str
    factory: type
    file: str
    defaults: Mapping[str, Any] = field(default_factory=dict)

    @property
    def summary(self) -> str:
        """The first line of its docstring."""
        return (inspect.getdoc(self.factory) or "").partition("\n")[0]

    @property
    def source(self) -> str:
        """The paragraph `Source: ...` of its docstring, on one line."""
        return self.paragraph("Source")

    def paragraph(self, title: str) -> str:
        """Return the paragraph `title: ...` of its docstring on one line, or an empty text."""
        _, _, text = (inspect.getdoc(self.factory) or "").partition(f"{title}: ")
        return " ".join(text.partition("\n\n")[0].split()).rstrip(".")

    @cached_property
    def parameters(self) -> Mapping[str, Parameter]:
        """Its parameters, with their defaults."""
        return {
            name: replace(parameter, default=self.defaults.get(name, parameter.default))
            for name, parameter in parameters_of(self.factory).items()
        }


METHOD: Final[Mapping[Kind, str]] = MappingProxyType(
    {
        "formulation": "velocity(problem, solve)",
        "scenario": "case(robot, change)",
        "plant": "drive(v, v_before, limits, dt)",
    }
)
"""What a plug-in of each kind must define."""

MISFIT: Final[Mapping[Kind, str]] = MappingProxyType(
    {
        "formulation": "has no method velocity(problem, solve)",
        "scenario": "is not derived from dikbench.scenario.Family",
        "plant": "is not derived from dikbench.scenario.Plant",
    }
)


def formulations_and_peers() -> Mapping[str, Plugin]:
    """Find every registered formulation and every peer, by name."""
    return {**plugins("formulation"), **plugins("peer")}


@lru_cache
def plugins(kind: Table) -> Mapping[str, Plugin]:
    """Find every registered plug-in of a table, by name.

    Raises:
        DikbenchError: if there is none (dikbench is not installed), a module has no table, an entry
            is not a plug-in, or two have the same name.
    """
    found: dict[str, Plugin] = {}
    if kind == "plant":
        found = {name: _registered("plant", _shipped(name)) for name in PLANTS}
    for entry in entries_of(kind):
        plugin = _registered("formulation" if kind == "peer" else kind, entry)
        if found.setdefault(plugin.name, plugin) != plugin:
            raise DikbenchError(
                f"two plug-ins are called {entry.name!r}: {found[entry.name].file} and "
                f"{plugin.file}"
            )
    if not found and kind != "peer":
        raise DikbenchError(
            f"no {kind}s are registered: dikbench is not installed here; "
            "run pip install -e . in its checkout"
        )
    return found


def _shipped(name: str) -> Named:
    plant = PLANTS[name]
    return Named(name, plant, plant.__module__, inspect.getsourcefile(plant) or "")


def formulation_plugin(name: str) -> Plugin:
    """Find the plug-in behind a formulation's name or `path/to/file.py:Class`."""
    return _plugin("formulation", name)


def scenario_plugin(name: str) -> Plugin:
    """Find the plug-in behind a scenario family's name or `path/to/file.py:Class`."""
    return _plugin("scenario", name)


def plant_plugin(name: str) -> Plugin:
    """Find the plug-in behind a plant's name or `path/to/file.py:Class`."""
    return _plugin("plant", name)


IS: Final[Mapping[Kind, Callable[[Any], bool]]] = MappingProxyType(
    {
        "formulation": lambda value: callable(getattr(value, "velocity", None)),
        "scenario": lambda value: isinstance(value, type) and issubclass(value, Family),
        "plant": lambda value: isinstance(value, type) and issubclass(value, Plant),
    }
)
"""Says whether what a file defines is of a kind."""


def kind_of(value: Any) -> Kind | None:
    """Say which of these kinds of plug-in something is; None where it is neither."""
    return next((kind for kind in ("scenario", "plant", "formulation") if IS[kind](value)), None)


def _plugin(kind: Kind, name: str) -> Plugin:
    if in_file(name):
        fits: Callable[[Any], bool] = lambda value: kind_of(value) is not None  # noqa: E731
        nothing = "no formulation, no family and no plant"
        entry = named_in_file(name, fits, nothing)
        return _registered(kind, replace(entry, name=name.rpartition(":")[2]))
    known = formulations_and_peers() if kind == "formulation" else plugins(kind)
    if name not in known:
        where = "(or give path/to/file.py:Class)"
        raise unknown(kind, name, known, where, f"dikbench list {kind}s")
    return known[name]


def _registered(kind: Kind, named: Named) -> Plugin:
    """Check an entry of a table, or a class of a file, and describe it as a plug-in."""
    factory, defaults = named.value, {}
    if isinstance(factory, partial):
        factory = factory.func
    elif is_dataclass(factory) and not isinstance(factory, type):
        defaults = {own.name: getattr(factory, own.name) for own in fields(factory) if own.init}
        factory = type(factory)
    where = f"{named.file}: {kind} {named.name!r}"
    if not isinstance(factory, type):
        raise DikbenchError(f"{where} is no class, nor an instance of one")
    if not IS[kind](factory):
        raise DikbenchError(f"{where} {MISFIT[kind]}")
    if inspect.isabstract(factory):
        raise DikbenchError(f"{where} has no method {METHOD[kind]}")
    if not is_dataclass(factory):
        raise DikbenchError(f"{where}: write @dataclass(frozen=True) above class {named.name}")
    try:
        parameters = parameters_of(factory)
    except DikbenchError as error:
        raise DikbenchError(f"{where}: {error}") from None
    reserved, instead = RESERVED.get(kind, ("", ""))
    if reserved in parameters:
        raise DikbenchError(
            f"{where}: a parameter cannot be called {reserved!r}, {instead}; valid: another name"
        )
    if isinstance(named.value, partial):
        given, entry = dict(zip(parameters, named.value.args, strict=False)), named.value
        defaults = {**given, **entry.keywords}
    file = named.file
    if factory is not named.value:  # the table says nothing of the class
        try:
            file = inspect.getsourcefile(factory) or file
        except TypeError:
            pass
    return Plugin(named.name, factory, file, defaults)
