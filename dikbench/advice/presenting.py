"""Advice presented: its worst run kept, its figures drawn, its page and its rows written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pandas as pd

from dikbench.advice.advising import Advice
from dikbench.advice.control_loop import control_loop
from dikbench.advice.in_words import whole
from dikbench.advice.page import write_page
from dikbench.advice.pictures import draw_arm, draw_path, draw_phases
from dikbench.advice.trying import plain
from dikbench.advice.worst_case import in_words, keep_worst
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.run.in_workers import RunSettings

Chapters = list[tuple[str, list[str]]]


def present(
    advice: Advice, folder: Path, page: Path, settings: RunSettings, again: str
) -> tuple[Chapters, str]:
    """Write everything about advice, and return what it says: chapters, and a program.

    Args:
        advice: the advice.
        folder: results folder: `advice.csv`, the worst run, figures.
        page: the file of the page.
        settings: how the worst run is run.
        again: the command that gives this advice.

    Raises:
        DikbenchError: if something cannot be written.
    """
    figures = folder / "figures"
    try:
        figures.mkdir(parents=True, exist_ok=True)
        rows = pd.DataFrame(map(plain, advice.tries.rows))
        rows.to_csv(folder / "advice.csv", index=False)
    except OSError as error:
        raise DikbenchError(f"folder {folder}: {error.strerror or error}") from None
    worst = lines = None
    if advice.search is not None:
        one = replace(settings, jobs=1)
        worst = keep_worst(advice.search, "", folder / "worst", one)
        lines = in_words(advice.search)
    chosen, program = advice.chosen, ""
    if chosen is not None:
        program = control_loop(advice.arm.parameters, advice.dt, chosen.formulation, chosen.solver)
    chapters = whole(advice, worst, lines or [], again)
    of_arm = [draw_arm(advice.arm, figures)]
    given = next((each for each, _ in advice.tries.cases if each.name == "csv"), None)
    if given is not None and (drawn := draw_path(make_scenario(given), figures)) is not None:
        of_arm.append(drawn)
    title = (
        f"Advice for {advice.arm.robot.name}, frame {advice.arm.robot.frame}, dt {advice.dt:g} s"
    )
    write_page(
        page, title, chapters, advice.answers, of_arm, draw_phases(advice.phase, figures), figures,
        program,
    )  # fmt: skip
    return chapters, program
