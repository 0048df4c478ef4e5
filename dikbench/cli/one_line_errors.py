"""Errors of a command, in one line."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from typing import Any

import click

from dikbench.errors import DikbenchError


def one_line_errors(command: Callable[..., None]) -> Callable[..., None]:
    """Turn an error that a user caused into one line on stderr and exit code 2."""

    @functools.wraps(command)
    def wrapped(*args: Any, **kwargs: Any) -> None:
        try:
            command(*args, **kwargs)
        except DikbenchError as error:
            click.echo("error: " + " ".join(str(error).split()), err=True)
            sys.exit(2)

    return wrapped
