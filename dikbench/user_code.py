"""Code of other authors: named by an entry point, or as `path/to/file.py:Name`.

Every kind of plug-in is found in these two ways. An entry point in the group `dikbench.KINDs` names
a module with a table `KINDS`, name -> plug-in.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os.path
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType
from typing import Any, Final, Literal

from dikbench.errors import DikbenchError, in_words, unknown
from dikbench.selector import Selector

Kind = Literal["formulation", "scenario", "solver", "plant", "robot", "metric"]

TABLES: Final[Mapping[str, str]] = {
    "formulation": "formulations",
    "peer": "formulations",
    "scenario": "scenarios",
    "solver": "solvers",
    "plant": "plants",
    "robot": "robots",
    "metric": "metrics",
}
"""The group of entry points, after `dikbench.`, in which a table of some kind is looked for."""


@dataclass(frozen=True)
class Named:
    """What a name stands for.

    Attributes:
        name: the name, as in a selector.
        value: the object.
        module: the module whose source it is.
        file: the file of that module.
    """

    name: str
    value: Any
    module: str
    file: str


@dataclass(frozen=True)
class Pluggable:
    """A kind of plug-in: those that come with dikbench, and what another one must be.

    Attributes:
        kind: the kind.
        shipped: those that come with dikbench, by name.
        misfit: says why an object is none, to follow its name; an empty text where it is one.
    """

    kind: Kind
    shipped: Mapping[str, Any]
    misfit: Callable[[Any], str]

    def __contains__(self, name: object) -> bool:
        """Say whether a name is known: shipped, or of an entry point; files are not looked into."""
        return name in self.shipped or name in registered(self.kind)

    def names(self) -> list[str]:
        """List the names that are shipped, then those of entry points."""
        return [*self.shipped, *self.others()]

    def others(self) -> Mapping[str, Named]:
        """Return those of entry points, by name.

        Raises:
            DikbenchError: if one is none of this kind, or has the name of one that is shipped.
        """
        found = registered(self.kind)
        for name, entry in found.items():
            self._check(entry)
            if name in self.shipped:
                raise DikbenchError(
                    f"{entry.file}: a {self.kind} of dikbench is called {name!r} already; valid: "
                    "another name"
                )
        return found

    def find(self, name: str) -> Named | None:
        """Find what is not shipped: of a file, or of an entry point; None for a shipped one.

        Raises:
            DikbenchError: if there is no such thing, or it is none of this kind.
        """
        if in_file(name):
            entry = named_in_file(name, lambda value: not self.misfit(value), f"no {self.kind}")
            self._check(entry)
            return entry
        if name in self.shipped:
            return None
        others = self.others()
        if name not in others:
            where = "(or give path/to/file.py:Name)"
            raise unknown(self.kind, name, self.names(), where, f"dikbench list {self.kind}s")
        return others[name]

    def _check(self, entry: Named) -> None:
        if wrong := self.misfit(entry.value):
            raise DikbenchError(f"{entry.file}: {self.kind} {entry.name!r} {wrong}")


def in_file(name: str) -> bool:
    """Say whether a selector's name has the form `path/to/file.py:Name`, or lacks the name."""
    return name.rpartition(":")[0].endswith(".py") or name.endswith(".py")


def names_code(selector: Selector) -> bool:
    """Say whether a selector names code in a file: itself, or by a parameter (a robot, `then`)."""
    return any(map(in_file, (selector.name, *selector.parameters.values())))


def named_in_file(name: str, fits: Callable[[Any], bool], nothing: str) -> Named:
    """Import what `path/to/file.py:Name` names.

    Args:
        name: the text.
        fits: what the file could have been named for, where the name lacks.
        nothing: what a file holds that has nothing of it ("no formulation and no family").

    Raises:
        DikbenchError: if there is no such file or name, or the file cannot be imported.
    """
    if name.endswith(".py"):
        own = own_names(module_from_file(name))
        valid = ", ".join(f"{name}:{each}" for each, value in own.items() if fits(value))
        valid = valid or f"none, for it holds {nothing}"
        raise DikbenchError(f"{name} names a file without a class; valid: {valid}")
    path, _, wanted = name.rpartition(":")
    module = module_from_file(path)
    if not hasattr(module, wanted):
        own = own_names(module)
        known = [each for each, value in own.items() if isinstance(value, type) or fits(value)]
        raise unknown("class", wanted, known, f"in {path}")
    value = getattr(module, wanted)
    home = value.__module__ if isinstance(value, type) else module.__name__
    file = os.path.abspath(path)
    if home != module.__name__:  # it is imported there
        file = getattr(sys.modules.get(home), "__file__", None) or file
    return Named(name, value, home, file)


def own_names(module: ModuleType) -> dict[str, Any]:
    """Return what a module defines, by name: its own classes, and all that is no class."""
    return {
        name: value
        for name, value in vars(module).items()
        if not name.startswith("__")
        and (not isinstance(value, type) or value.__module__ == module.__name__)
    }


@lru_cache
def module_from_file(path: str) -> ModuleType:
    """Import a file that the user named, once in a process.

    Raises:
        DikbenchError: if it is not there, or cannot be imported.
    """
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


@lru_cache
def registered(kind: str) -> Mapping[str, Named]:
    """Find what entry points name of a kind that needs none, by name.

    Raises:
        DikbenchError: if a module cannot be imported or has no table, a name is none, or two are
            the same.
    """
    found: dict[str, Named] = {}
    for entry in entries_of(kind):
        if found.setdefault(entry.name, entry) != entry:
            raise DikbenchError(
                f"two plug-ins are called {entry.name!r}: {found[entry.name].file} and {entry.file}"
            )
    return found


@contextmanager
def entry_points_added(points: Sequence[EntryPoint], folders: Sequence[Path]) -> Iterator[None]:
    """Have the entry points of a project found that need not be installed, in this process alone.

    Args:
        points: its entry points.
        folders: where its modules are.
    """
    added = [str(folder.absolute()) for folder in folders]
    sys.path[:0] = added
    _OF_PROJECTS.extend(points)
    registered.cache_clear()
    try:
        yield
    finally:
        for each in added:
            sys.path.remove(each)
        for point in points:
            _OF_PROJECTS.remove(point)
        registered.cache_clear()


def entries_of(table: str, points: Iterable[EntryPoint] | None = None) -> Iterator[Named]:
    """Yield every entry of the tables of a kind, in the order of the entry points.

    Args:
        table: what they are tables of.
        points: the entry points; default: all that are installed or added.

    Raises:
        DikbenchError: if a module cannot be imported or has no table, or a name is none.
    """
    group = f"dikbench.{TABLES[table]}"
    if points is None:
        points = [*importlib.metadata.entry_points(group=group), *_OF_PROJECTS]
    for entry_point in points:
        if getattr(entry_point, "group", group) != group:
            continue
        where = f"plug-in {entry_point.name!r} of {group}"
        try:
            module = _loaded(entry_point)
        except Exception as error:
            raise DikbenchError(
                f"{where} ({entry_point.value}) cannot be imported: {in_words(error)}"
            ) from error
        yield from entries_in(module, table, where, entry_point.value.partition(".")[0])


def entries_in(module: ModuleType, table: str, where: str, top: str) -> Iterator[Named]:
    """Yield the entries of the table of a module.

    Args:
        module: the module.
        table: what it is a table of.
        where: which plug-in it is, for errors.
        top: the package that the module should be of.

    Raises:
        DikbenchError: if the module has no table, or a name is none.
    """
    attribute = f"{table.upper()}S"
    held = getattr(module, attribute, {} if table == "peer" else None)
    if not isinstance(held, Mapping):
        places = [*getattr(module, "__path__", ())]  # a folder without __init__.py has no file
        file = getattr(module, "__file__", None) or (places[0] if places else repr(module))
        raise DikbenchError(
            f"{where}: {file} holds no mapping {attribute}; if it is not the plug-in's, a "
            f"folder or module {top!r} of yours hides it: valid: another name"
        )
    file = getattr(module, "__file__", None) or repr(module)
    for name, value in held.items():
        if not isinstance(name, str) or not name or set(name) & set("[],= \t\n"):
            raise DikbenchError(f"{file}: {name!r} is not a name (no brackets, commas or spaces)")
        home = value.__module__ if isinstance(value, type) else module.__name__
        at = getattr(sys.modules.get(home), "__file__", None) or file
        yield Named(name, value, home, at)


_OF_PROJECTS: list[EntryPoint] = []


def _loaded(entry_point: EntryPoint) -> Any:
    """Load what an entry point names; what is installed beside dikbench comes first.

    A folder `formulations` or `scenarios` beside a user's script would hide those of dikbench.
    """
    beside = str(Path(__file__).parents[1])
    sys.path.insert(0, beside)
    try:
        return entry_point.load()
    finally:
        sys.path.remove(beside)
