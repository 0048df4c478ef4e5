"""A figure that was drawn."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """A figure in the folder of figures: an SVG, and a PNG of the same name beside it.

    Attributes:
        file: name of the SVG.
        caption: what it shows and how to read it, in a sentence or two.
        title: what it is, in a few words; also what stands in its place where it cannot be seen.
    """

    file: str
    caption: str
    title: str = ""

    @property
    def png(self) -> str:
        """Name of the PNG."""
        return self.file.removesuffix(".svg") + ".png"
