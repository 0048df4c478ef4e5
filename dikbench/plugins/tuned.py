"""The tuned parameters of formulations: `tuned.toml` in the folder of their file.

`dikbench tune --freeze` writes it, and the selector `name[tuned]` reads it.
"""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Final

import msgspec

from dikbench.errors import DikbenchError
from dikbench.parameters import Drawn
from dikbench.plugins.drawing import DIGITS
from dikbench.plugins.finding import formulation_plugin
from dikbench.plugins.source import source_digest
from dikbench.selector import TUNED, Selector, listed

FILE: Final = "tuned.toml"


class Tuned(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The tuned parameters of a formulation, and how they were found.

    Attributes:
        parameters: the values found; empty where nothing tried was better than the defaults.
        study, seed, budget: the study of the train split, the seed of the points, their number.
        source: hash of the source of the formulation that was tuned.
        success, default_success: mean rate of success on that study, tuned and at the defaults.
    """

    parameters: dict[str, float]
    study: str
    seed: int
    budget: int
    source: str
    success: float
    default_success: float


def ranges_of(selector: Selector) -> Mapping[str, Drawn]:
    """Return the ranges of the parameters that are tuned: numbers that the selector leaves open.

    Raises:
        DikbenchError: if there is no such formulation.
    """
    parameters = formulation_plugin(selector.name).parameters
    return {
        name: parameter.drawn
        for name, parameter in parameters.items()
        if parameter.drawn is not None and parameter.numeric and name not in selector.parameters
    }


def key_of(selector: Selector) -> str:
    """Return the name of a formulation in the file: its selector, a path without its folder."""
    plugin = formulation_plugin(selector.name)
    file, colon, name = selector.name.rpartition(":")
    name = f"{Path(file).name}{colon}{name}" if file else name
    return str(Selector(name, selector.parameters).ordered(plugin.parameters))


def file_for(selector: Selector) -> Path:
    """Return the file with the tuned parameters of a formulation, which need not exist."""
    return Path(formulation_plugin(selector.name).file).with_name(FILE)


def read_tuned(file: Path) -> Mapping[str, Tuned]:
    """Read a file of tuned parameters, by formulation; a missing one is empty.

    Raises:
        DikbenchError: if it cannot be read, or is no such file.
    """
    try:
        modified = file.stat().st_mtime_ns
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise DikbenchError(f"file {file}: {error.strerror or error}") from None
    return _read(file, modified)


@lru_cache(maxsize=8)
def _read(file: Path, _modified: int) -> Mapping[str, Tuned]:
    """Read a file, again when it has been written since."""
    try:
        return msgspec.toml.decode(file.read_bytes(), type=dict[str, Tuned])
    except OSError as error:
        raise DikbenchError(f"file {file}: {error.strerror or error}") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise DikbenchError(f"file {file}: not tuned parameters: {error}") from None


def with_tuned(selector: Selector) -> Selector:
    """Replace `tuned` in a formulation's selector by the parameters for which it stands.

    Raises:
        DikbenchError: if the formulation is unknown, or not tuned with the other parameters given.
    """
    if selector.parameters.get(TUNED) != "true":
        return selector
    given = {name: text for name, text in selector.parameters.items() if name != TUNED}
    plain = Selector(selector.name, given)
    if given.keys() - formulation_plugin(selector.name).parameters.keys():
        return plain  # building it gives the error
    file, key = file_for(plain), key_of(plain)
    known, command = read_tuned(file), f"dikbench tune --freeze {shlex.quote(str(plain))}"
    if key not in known:
        asked = f"{TUNED},{listed(given)}" if given else TUNED
        where, valid = f"formulation {plain.name}[{asked}]", ", ".join(known) or "none yet"
        open_at_all = ranges_of(Selector(selector.name))
        if not open_at_all:
            raise DikbenchError(f"{where}: it has no parameter to tune; valid: {plain}")
        if not ranges_of(plain):
            raise DikbenchError(
                f"{where}: it gives what tuning finds ({', '.join(open_at_all)}); valid: {plain} "
                f"or {selector.name}[{TUNED}]"
            )
        raise DikbenchError(
            f"{where}: {key!r} is not tuned in {file}; valid: {valid}; `{command}` adds it"
        )
    if known[key].source != source_digest(formulation_plugin(selector.name)):
        warnings.warn(
            f"{key} has another source than when it was tuned ({file}); `{command}` tunes it again",
            stacklevel=2,
        )
    found = {name: f"{value:.{DIGITS}g}" for name, value in known[key].parameters.items()}
    return Selector(selector.name, {**given, **found})
