"""Formulations and scenario families, found through entry points or in a file.

An entry point in the group `dikbench.formulations` or `dikbench.scenarios` names a module that
has a table `FORMULATIONS` or `SCENARIOS`: name -> class, an instance of a class (whose values
are then the defaults), or a `functools.partial` of one. A module of formulations may have a table
`PEERS` as well, of other libraries as formulations: they are found by name, and are not among "all
formulations", which do not depend on what is installed.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import inspect
import os.path
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property, lru_cache, partial
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any, Final, Literal

from dikbench.errors import DikbenchError, in_words, unknown
from dikbench.parameters import Parameter, parameters_of
from dikbench.scenario.family import Family
from dikbench.selector import TUNED

Kind = Literal["formulation", "scenario"]
Table = Literal["formulation", "scenario", "peer"]

RESERVED: Final[Mapping[Kind, tuple[str, str]]] = MappingProxyType(
    {
        "formulation": (TUNED, f"for name[{TUNED}] selects the tuned parameters"),
        "scenario": ("seed", "for --seed selects it"),
    }
)
"""The word that selectors of a kind have for themselves, and what it does."""


@dataclass(frozen=True)
class Plugin:
    """A formulation or a scenario family as it was registered.

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
    group = f"dikbench.{'formulation' if kind == 'peer' else kind}s"
    found: dict[str, Plugin] = {}
    for entry_point in importlib.metadata.entry_points(group=group):
        where = f"plug-in {entry_point.name!r} of {group}"
        try:
            module = _loaded(entry_point)
        except Exception as error:
            raise DikbenchError(
                f"{where} ({entry_point.value}) cannot be imported: {in_words(error)}"
            ) from error
        file = getattr(module, "__file__", None) or repr(module)
        table = getattr(module, f"{kind.upper()}S", {} if kind == "peer" else None)
        if not isinstance(table, Mapping):
            top = entry_point.value.partition(".")[0]
            raise DikbenchError(
                f"{where}: {file} holds no mapping {kind.upper()}S; if it is not the plug-in's, a "
                f"folder or module {top!r} of yours hides it: valid: another name"
            )
        for name, entry in table.items():
            plugin = _registered(
                "scenario" if kind == "scenario" else "formulation", name, entry, file
            )
            if found.setdefault(plugin.name, plugin) != plugin:
                raise DikbenchError(
                    f"two plug-ins are called {name!r}: {found[name].file} and {plugin.file}"
                )
    if not found and kind != "peer":
        raise DikbenchError(
            f"no {kind}s are registered: dikbench is not installed here; "
            "run pip install -e . in its checkout"
        )
    return found


def _loaded(entry_point: importlib.metadata.EntryPoint) -> Any:
    """Load what an entry point names; what is installed beside dikbench comes first.

    A folder `formulations` or `scenarios` beside a user's script would hide those of dikbench.
    """
    beside = str(Path(__file__).parents[2])
    sys.path.insert(0, beside)
    try:
        return entry_point.load()
    finally:
        sys.path.remove(beside)


def formulation_plugin(name: str) -> Plugin:
    """Find the plug-in behind a formulation's name or `path/to/file.py:Class`."""
    return _plugin("formulation", name)


def scenario_plugin(name: str) -> Plugin:
    """Find the plug-in behind a scenario family's name or `path/to/file.py:Class`."""
    return _plugin("scenario", name)


def in_file(name: str) -> bool:
    """Say whether a selector's name has the form `path/to/file.py:Class`, or lacks the class."""
    return name.rpartition(":")[0].endswith(".py") or name.endswith(".py")


def _file_and_class(name: str) -> tuple[str, str]:
    """Split `path/to/file.py:Class`.

    Raises:
        DikbenchError: if there is no class; the message names those of the file.
    """
    if not name.endswith(".py"):
        path, _, class_name = name.rpartition(":")
        return path, class_name
    own = [
        value
        for value in _own_classes(_module_from_file(name))
        if issubclass(value, Family) or callable(getattr(value, "velocity", None))
    ]
    valid = ", ".join(f"{name}:{value.__name__}" for value in own)
    raise DikbenchError(
        f"{name} names a file without a class; valid: "
        f"{valid or 'none, for it holds no formulation and no family'}"
    )


def kind_in_file(name: str) -> Kind:
    """Say whether a class in a user's file is a formulation or a family."""
    found = _class_from_file(*_file_and_class(name))
    return "scenario" if issubclass(found, Family) else "formulation"


def _plugin(kind: Kind, name: str) -> Plugin:
    if in_file(name):
        path, class_name = _file_and_class(name)
        found = _class_from_file(path, class_name)
        plugin = _registered(kind, class_name, found, path)
        if found.__module__ != _module_from_file(path).__name__:  # it is imported there
            return plugin
        # Another file of this name, in another folder, may have taken the module's place.
        return replace(plugin, file=os.path.abspath(path))
    known = plugins(kind) if kind == "scenario" else formulations_and_peers()
    if name not in known:
        where = "(or give path/to/file.py:Class)"
        raise unknown(kind, name, known, where, f"dikbench list {kind}s")
    return known[name]


def _registered(kind: Kind, name: object, entry: Any, file: str) -> Plugin:
    """Check an entry of a table, or a class of a file, and describe it as a plug-in."""
    if not isinstance(name, str) or not name or set(name) & set("[],= \t\n"):
        raise DikbenchError(f"{file}: {name!r} is not a name (no brackets, commas or spaces)")
    factory, defaults = entry, {}
    if isinstance(entry, partial):
        factory = entry.func
    elif is_dataclass(entry) and not isinstance(entry, type):
        factory = type(entry)
        defaults = {own.name: getattr(entry, own.name) for own in fields(entry) if own.init}
    where = f"{file}: {kind} {name!r}"
    if not isinstance(factory, type):
        raise DikbenchError(f"{where} is no class, nor an instance of one")
    if kind == "formulation" and not callable(getattr(factory, "velocity", None)):
        raise DikbenchError(f"{where} has no method velocity(problem, solve)")
    if kind == "scenario" and not issubclass(factory, Family):
        raise DikbenchError(f"{where} is not derived from dikbench.scenario.Family")
    if kind == "scenario" and inspect.isabstract(factory):
        raise DikbenchError(f"{where} has no method case(robot, change)")
    if not is_dataclass(factory):
        raise DikbenchError(f"{where}: write @dataclass(frozen=True) above class {name}")
    try:
        parameters = parameters_of(factory)
    except DikbenchError as error:
        raise DikbenchError(f"{where}: {error}") from None
    reserved, instead = RESERVED[kind]
    if reserved in parameters:
        raise DikbenchError(
            f"{where}: a parameter cannot be called {reserved!r}, {instead}; valid: another name"
        )
    if isinstance(entry, partial):
        defaults = {**dict(zip(parameters, entry.args, strict=False)), **entry.keywords}
    try:
        file = inspect.getsourcefile(factory) or file
    except TypeError:
        pass
    return Plugin(name, factory, file, defaults)


def _class_from_file(path: str, class_name: str) -> type:
    """Import a class from a file that the user named."""
    module = _module_from_file(path)
    found = getattr(module, class_name, None)
    if not isinstance(found, type):
        classes = [value.__name__ for value in _own_classes(module)]
        raise unknown("class", class_name, classes, f"in {path}")
    return found


def _own_classes(module: ModuleType) -> list[type]:
    own = [value for value in vars(module).values() if isinstance(value, type)]
    return [value for value in own if value.__module__ == module.__name__]


@lru_cache
def _module_from_file(path: str) -> ModuleType:
    file = Path(path)
    if not os.path.isfile(path):  # unlike Path.is_file, False for a name that is too long
        raise DikbenchError(f"file not found: {path}; valid: path/to/file.py:Class")
    spec = importlib.util.spec_from_file_location(f"dikbench_user_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses and pickle look it up
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        slip = "non-frozen dataclass from a frozen" in str(error)
        hint = "; valid: @dataclass(frozen=True) above the class" if slip else ""
        said = str(error) if isinstance(error, DikbenchError) else in_words(error) + hint
        raise DikbenchError(f"{path} cannot be imported: {said}") from error
    return module
