"""What keeps several checks from being made, so that it is named once."""

from __future__ import annotations


class CannotCheck(AssertionError):
    """There is nothing that could be checked.

    Attributes:
        cause: why, in one line, the same for every check that it keeps from being made.
    """

    def __init__(self, message: str, cause: str) -> None:
        super().__init__(message)
        self.cause = cause
