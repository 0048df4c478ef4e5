"""Over which cases numbers are: how many scenarios, and of which robots."""

from __future__ import annotations

from typing import Final

import pandas as pd

from dikbench.report.sentences.words import listed, several

MOST_OF_ONE_ROBOT: Final = 0.5
"""Where one robot has a larger share of the cases than this, it is said."""


def cases_in_words(part: pd.DataFrame) -> str:
    """Say how many cases some rows are of, and of which robots, those of most scenarios first.

    Such as: 20 cases (10 scenarios of 3 robots, ur5 8, iiwa 1 and panda 1; ur5 has 16 of the
    cases).
    """
    cases = part[["scenario", "seed"]].drop_duplicates()
    return f"{several(len(cases), 'case')} ({scenarios_in_words(part)})"


def scenarios_in_words(part: pd.DataFrame) -> str:
    """Say how many scenarios some rows are of, and of which robots; see `cases_in_words`."""
    cases = part[["scenario", "seed", "robot"]].drop_duplicates()
    scenarios = cases.drop_duplicates(["scenario", "robot"])["robot"].value_counts()
    counts = sorted(scenarios.items(), key=lambda pair: (-pair[1], str(pair[0])))
    number = several(cases["scenario"].nunique(), "scenario")
    if len(counts) == 1:
        return f"{number} of one robot, {_plain(counts[0][0])}"
    robots = listed([f"{_plain(robot)} {count}" for robot, count in counts])
    said = f"{number} of {len(counts)} robots, {robots}"
    of_robot = cases["robot"].value_counts()
    if of_robot.max() > MOST_OF_ONE_ROBOT * len(cases):
        said += f"; {_plain(of_robot.idxmax())} has {of_robot.max()} of the cases"
    return said


def _plain(robot: object) -> str:
    """Write the name of a robot, which may be of a file of the user's, as text."""
    return " ".join(str(robot).split()).replace("`", "'")
