"""Files of obstacles: what is read, and what is said about every way to write one wrong."""

from __future__ import annotations

from pathlib import Path

import pytest
from makers.scenarios import error_of

from dikbench.robots.collision.obstacles import BoxObstacle, CapsuleObstacle, SphereObstacle
from dikbench.scenario.obstacle_file import read_obstacles

BALL = "[[sphere]]\ncentre = [1, 2, 3]\nradius = 0.5\n"


def _file(folder: Path, text: str | bytes) -> str:
    path = folder / "obstacles.toml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return str(path)


def test_tables_become_obstacles(tmp_path: Path) -> None:
    """In their order by kind; a box is turned where the file says so."""
    text = f"""
        [[box]]
        centre = [0, 0, -0.02]
        size = [1, 1.0, 0.04]

        [[box]]
        centre = [0, 0, 0]
        size = [1, 2, 3]
        rotation = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]

        [[capsule]]
        start = [0, 0, 0]
        end = [0, 0, 1]
        radius = 0.1

        {BALL}"""
    ball, pole, table, turned = read_obstacles(_file(tmp_path, text))
    assert ball == SphereObstacle((1.0, 2.0, 3.0), 0.5)
    assert pole == CapsuleObstacle((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.1)
    assert table == BoxObstacle((0.0, 0.0, -0.02), (1.0, 1.0, 0.04))
    assert isinstance(turned, BoxObstacle)
    assert turned.geometry()[1].rotation[:, 0] == pytest.approx([0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no obstacle; valid: [[sphere]] with centre, radius, [[capsule]] with start, end,"),
        ("sphere = 3", "Expected `array`, got `int` - at `$.sphere`"),
        ("[[ball]]\nradius = 1", "unknown field `ball`; valid: [[sphere]] with"),
        (BALL + "colour = 'red'", "unknown field `colour` - at `$.sphere[0]`"),
        (BALL.replace(", 3", ""), "Expected `array` of length 3, got 2 - at `$.sphere[0].centre`"),
        (BALL.replace("2", "'b'"), "Expected `float`, got `str` - at `$.sphere[0].centre[1]`"),
        (BALL.replace("2", "nan"), "sphere 1: SphereObstacle: centre: expected finite numbers"),
        (BALL + BALL.replace("0.5", "-1"), "sphere 2: SphereObstacle: radius=-1.0 must be"),
        ("[[sphere]]\nradius = 1", "missing required field `centre`"),
        ("[[sphere", "not valid TOML"),
        (b"\xff\xfe", "not a text file in UTF-8"),
    ],
)
def test_errors_say_where_and_what_would_be_valid(
    text: str | bytes, words: str, tmp_path: Path
) -> None:
    """One line each, with the file's path."""
    path = _file(tmp_path, text)
    error = error_of(read_obstacles, path)
    assert error.startswith(f"obstacle file {path}: ")
    assert words in error


def test_a_file_that_is_missing_is_an_error_of_one_line(tmp_path: Path) -> None:
    """A folder too."""
    for path in (str(tmp_path), str(tmp_path / "nowhere.toml")):
        assert error_of(read_obstacles, path) == f"obstacle file not found: {path}"
