"""Traces in files: they come back as they were, and what is none is refused."""

from __future__ import annotations

import io
import pickle
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from makers.scenarios import at_step, exact, planar_scenario, raises, run_on_planar
from makers.traces import assert_same_trace

from dikbench.errors import DikbenchError, Infeasible
from dikbench.simulation.status import Status
from dikbench.simulation.trace import Trace


def test_a_trace_comes_back_as_it_was_saved(tmp_path: Path) -> None:
    """Every array to the bit, with its type."""
    trace = run_on_planar(
        at_step(7, lambda: raises(Infeasible("x"))), planar_scenario(acceleration=5.0)
    ).trace
    path = tmp_path / "trace.arrow"
    trace.save(path)
    assert_same_trace(Trace.load(path), trace)
    assert isinstance(Trace.load(path).dt, float)


def test_an_empty_trace_can_be_saved(tmp_path: Path) -> None:
    """A trial that ended at step 0 has one configuration and no step."""
    trace = run_on_planar(lambda problem: None).trace
    assert trace.steps == 0
    assert np.isnan(trace.share(Status.OK))
    trace.save(tmp_path / "trace.arrow")
    assert_same_trace(Trace.load(tmp_path / "trace.arrow"), trace)


class _Payload:
    """An object that does something when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> Any:
        return (Path.touch, (self.path,))


def _pickled(proof: Path, kind: str) -> bytes:
    """The payload in a file of some kind that can hold a pickle."""
    stored = io.BytesIO()
    if kind == "pickle":
        pickle.dump(_Payload(proof), stored)
    elif kind == "npy":
        np.save(stored, np.array([_Payload(proof)], dtype=object), allow_pickle=True)
    elif kind == "npz":
        np.savez(stored, q=np.array([_Payload(proof)], dtype=object))
    else:  # what made old versions of Arrow for Python run it
        field = pa.field("q", pa.binary()).with_metadata(
            {
                "ARROW:extension:name": "arrow.py_extension_type",
                "ARROW:extension:metadata": pickle.dumps(_Payload(proof)),
            }
        )
        table = pa.table([pa.array([b"x"])], schema=pa.schema([field], {"dt": "0.01"}))
        with pa.ipc.new_file(stored, table.schema) as file:
            file.write_table(table)
    return stored.getvalue()


def _unpickle(data: bytes, kind: str) -> None:
    """Run what is hidden in such a file."""
    stored = io.BytesIO(data)
    if kind == "pickle":
        pickle.load(stored)
    elif kind == "npy":
        np.load(stored, allow_pickle=True)
    elif kind == "npz":
        np.load(stored, allow_pickle=True)["q"]
    else:
        pickle.loads(data[data.index(b"\x80\x04\x95") :])


@pytest.mark.parametrize("kind", ["pickle", "npy", "npz", "arrow"])
def test_no_pickle_is_read(tmp_path: Path, kind: str) -> None:
    """A trace from outside is data: what holds a pickle is refused before it is run."""
    proof, path = tmp_path / "proof", tmp_path / "trace.arrow"
    path.write_bytes(_pickled(proof, kind))
    _assert_refused(path)
    assert not proof.exists()
    # The payload is a real one: it would be run by what unpickles it.
    _unpickle(path.read_bytes(), kind)
    assert proof.exists()


def _assert_refused(path: Path) -> None:
    """As no trace, on one line that names the file."""
    with pytest.raises(DikbenchError, match="not a trace of dikbench") as caught:
        Trace.load(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_no_trace_is_refused(tmp_path: Path) -> None:
    """No file, an empty one, a folder, text, half a trace."""
    path = tmp_path / "trace.arrow"
    _assert_refused(path)
    _assert_refused(tmp_path)
    for data in (b"", b"q\n1.0\n", b"ARROW1\0\0", bytes(1000)):
        path.write_bytes(data)
        _assert_refused(path)
    run_on_planar(exact).trace.save(path)
    whole = path.read_bytes()
    Trace.load(path)
    path.write_bytes(whole[: len(whole) // 2])
    _assert_refused(path)


@pytest.mark.parametrize("missing", [field.name for field in fields(Trace) if field.name != "mode"])
def test_a_table_that_lacks_something_is_refused(tmp_path: Path, missing: str) -> None:
    """An Arrow file without one of the columns, or without the period, is no trace."""
    path = tmp_path / "trace.arrow"
    run_on_planar(exact).trace.save(path)
    with pa.ipc.open_file(str(path)) as file:
        table = file.read_all()
    if missing == "dt":
        table = table.replace_schema_metadata(None)
    else:
        table = table.drop_columns([missing])
    with pa.ipc.new_file(str(path), table.schema) as new:
        new.write_table(table)
    _assert_refused(path)


def test_a_table_of_words_is_refused(tmp_path: Path) -> None:
    """Columns of the right names are not enough."""
    names = [field.name for field in fields(Trace) if field.name != "dt"]
    table = pa.table({name: ["a", "b"] for name in names}, metadata={"dt": "0.01"})
    path = tmp_path / "trace.arrow"
    with pa.ipc.new_file(str(path), table.schema) as file:
        file.write_table(table)
    _assert_refused(path)
