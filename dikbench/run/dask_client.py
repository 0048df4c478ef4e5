"""The connection to the scheduler of a dask cluster."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from dikbench.errors import DikbenchError

SECONDS_OF_CONNECTION: Final = 20.0
"""Wall-clock limit of what is asked of the scheduler."""

SECONDS_BETWEEN_LOOKS: Final = 0.2
"""How often it is looked whether a scheduler has written its file."""


def scheduler_given(executor: str, scheduler: str) -> str:
    """Return the scheduler on whose cluster trials run; empty for this machine.

    Raises:
        DikbenchError: if executor and scheduler do not belong together.
    """
    if executor == "dask" and not scheduler:
        raise DikbenchError(
            "executor dask needs a scheduler; valid: its address, such as tcp://host:8786, or its "
            "file"
        )
    if executor != "dask" and scheduler:
        raise DikbenchError(f"scheduler {scheduler} is for executor dask; valid: with it")
    return scheduler


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """Connect to a cluster, and have dask log nothing meanwhile.

    Args:
        address: of its scheduler, such as `tcp://host:8786`, or the scheduler's file (.json).

    Returns:
        The client.

    Raises:
        DikbenchError: if dask.distributed is not installed, or there is no scheduler.
    """
    try:
        from distributed import Client
    except ImportError:
        raise DikbenchError(
            "dask.distributed is not installed; valid: pip install 'dikbench[dask]'"
        ) from None
    with _silent():
        try:
            where = _address_in(address) if address.endswith(".json") else address
            client = Client(where, timeout=SECONDS_OF_CONNECTION, set_as_default=False)
        except (OSError, TimeoutError, ValueError, TypeError, KeyError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise DikbenchError(
                f"scheduler {address} cannot be reached: {reason}; valid: the address of a "
                "scheduler, such as tcp://host:8786, or its file"
            ) from None
        try:
            yield client
        finally:
            with suppress(Exception):  # where it is lost
                client.close(timeout=SECONDS_OF_CONNECTION)


def _address_in(file: str) -> str:
    """Read the address in a scheduler's file, which is written when the scheduler has started.

    dask would wait for it for ever.
    """
    deadline = time.monotonic() + SECONDS_OF_CONNECTION
    while not Path(file).is_file() and time.monotonic() < deadline:
        time.sleep(SECONDS_BETWEEN_LOOKS)
    return str(json.loads(Path(file).read_bytes())["address"])


@contextmanager
def _silent() -> Iterator[None]:
    """Have dask log nothing meanwhile: what is lost is told in one line."""
    named = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    loggers = {logging.getLogger(name): logging.getLogger(name).disabled for name in named}
    for logger in loggers:
        logger.disabled = True
    try:
        yield
    finally:
        for logger, disabled in loggers.items():
            logger.disabled = disabled
