"""Every URDF of example-robot-data with every family that takes one: a scenario, or one line.

What came of it stands in results/robots.md, whose rows these tests make and print.
"""

from __future__ import annotations

from pathlib import Path
from time import process_time

import pinocchio as pin
import pytest

from dikbench.errors import DikbenchError
from dikbench.parameters import parameters_of
from dikbench.plugins.building import make_scenario
from dikbench.plugins.finding import plugins, scenario_plugin
from dikbench.robots.example_robot_data import data_file
from dikbench.robots.urdf import urdf_model

FOLDER = Path(data_file("."))
FILES = sorted(file.relative_to(FOLDER).as_posix() for file in FOLDER.rglob("*.urdf"))
TABLE = Path(__file__).parents[2] / "results" / "robots.md"
SLOWEST_LOADING_S, SLOWEST_BUILDING_S = 20.0, 60.0


def families() -> list[str]:
    """List the families that take any robot, but for the one that needs a file."""
    of_any = [
        name
        for name in plugins("scenario")
        if not parameters_of(scenario_plugin(name).factory)["robot"].choices
    ]
    return [name for name in of_any if name != "csv"]


def farthest_frame(model: pin.Model) -> tuple[str, int]:
    """Choose the last of the links that most joints move; return it with their number."""
    links = [frame for frame in model.frames if frame.type == pin.FrameType.BODY]
    count = {link.name: len(model.supports[link.parentJoint]) - 1 for link in links}
    most = max(count.values())
    return [name for name, number in count.items() if number == most][-1], most


def row_of(file: str) -> str:
    """Try a URDF with every family and write the row of the table."""
    start, message = process_time(), ""
    try:
        model, _ = urdf_model(str(FOLDER / file))
    except DikbenchError as error:
        message = str(error).replace(str(FOLDER), "")
    assert "\n" not in message
    assert process_time() - start < SLOWEST_LOADING_S
    if message:
        reason = message.removeprefix("robot file ").removeprefix(f"/{file}").strip(" :")
        return f"| {file} | refused: {reason} |{' |' * len(families())}"
    frame, joints = farthest_frame(model)
    rows = "rows=xyz" if 3 <= joints < 6 else ""
    at = ",".join(filter(None, [f'robot="{FOLDER / file}"', f'frame="{frame}"', rows]))
    cells = []
    for family in families():
        start, message = process_time(), ""
        try:
            make_scenario(f"{family}[{at}]")
        except DikbenchError as error:
            message = str(error)
        assert "\n" not in message
        assert process_time() - start < SLOWEST_BUILDING_S
        cells.append("" if message else "yes")
    return f"| {file} | {frame}, {joints} {rows} | {' | '.join(cells)} |"


@pytest.mark.long
@pytest.mark.parametrize("file", FILES)
def test_a_shipped_urdf_certifies_or_is_refused_in_one_line(file: str) -> None:
    """Within a minute each, and as the table says."""
    row = row_of(file)
    print(row)
    assert row in TABLE.read_text().splitlines()
