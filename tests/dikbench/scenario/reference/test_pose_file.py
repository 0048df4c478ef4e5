"""Files of target poses: what is read, and what is said about every way to write one wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dikbench.errors import DikbenchError
from dikbench.scenario.reference.pose_file import read_poses

HEADER = "t,x,y,z,qx,qy,qz,qw"
FIRST = "0,0.3,0,0.5,1,0,0,0"


def _file(folder: Path, *lines: str) -> str:
    path = folder / "poses.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def test_rows_become_placements_at_times_from_zero_on(tmp_path: Path) -> None:
    """A quarter turn about z at 0.5 s; times count from the first row's."""
    half = 2**-0.5
    poses = read_poses(_file(tmp_path, HEADER, "2,0,0,0,0,0,0,1", f"2.5,1,2,3,0,0,{half},{half}"))
    assert poses.times == (0.0, 0.5)
    assert poses.lines == (2, 3)
    assert poses.placements[1].translation == pytest.approx(np.array([1.0, 2.0, 3.0]))
    turned = poses.placements[1].rotation @ np.array([1.0, 0.0, 0.0])
    assert turned == pytest.approx(np.array([0.0, 1.0, 0.0]))


def test_columns_may_be_in_any_order_with_others_between_them(tmp_path: Path) -> None:
    """And spaces after the commas, a byte-order mark, empty lines."""
    path = tmp_path / "poses.csv"
    path.write_text(
        "\ufeffqw, qz, qy, qx, note, z, y, x, t\n1, 0, 0, 0, a, 3, 2, 1, 0\n\n"
        "1, 0, 0, 0, b, 6, 5, 4, 1\n",
        encoding="utf-8",
    )
    poses = read_poses(str(path))
    assert poses.placements[0].translation == pytest.approx(np.array([1.0, 2.0, 3.0]))
    assert poses.placements[1].translation == pytest.approx(np.array([4.0, 5.0, 6.0]))
    assert poses.lines == (2, 4)


def test_a_quaternion_whose_digits_were_cut_still_makes_a_rotation(tmp_path: Path) -> None:
    """0.707 for 1/sqrt(2): normalised, R R^T = I."""
    poses = read_poses(_file(tmp_path, HEADER, FIRST, "1,0,0,0,0,0,0.707,0.707"))
    R = poses.placements[1].rotation
    assert R @ R.T == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([], "no column 't'; expected: t,x,y,z,qx,qy,qz,qw"),
        (["t,x,y,z,qx,qy,qz", FIRST], "no column 'qw'; expected: t,x,y,z,qx,qy,qz,qw"),
        ([HEADER], "0 rows of poses; at least 2 are needed"),
        ([HEADER, FIRST], "1 rows of poses; at least 2 are needed"),
        ([HEADER, FIRST, "1,0.3,left,0.5,1,0,0,0"], "line 3: y='left' is not a finite number"),
        ([HEADER, FIRST, "1,0.3,0,inf,1,0,0,0"], "line 3: z='inf' is not a finite number"),
        ([HEADER, FIRST, "1,0.3,0,0.5,1,0,0"], "line 3: qw='' is not a finite number"),
        ([HEADER, FIRST, "1,,0,0.5,1,0,0,0"], "line 3: x='' is not a finite number"),
        ([HEADER, FIRST, FIRST], "line 3: t=0 must be above 0"),
        ([HEADER, "1,0,0,0,0,0,0,1", FIRST], "line 3: t=0 must be above 1"),
        (
            [HEADER, FIRST, "1,0,0,0,0,0,0,0.9"],
            "line 3: the quaternion's norm is 0.9, it must be 1",
        ),
        ([HEADER, FIRST, "1,0,0,0,0,0,0,0"], "line 3: the quaternion's norm is 0, it must be 1"),
    ],
)
def test_errors_name_the_line_and_what_would_be_valid(
    lines: list[str], words: str, tmp_path: Path
) -> None:
    """One line each, with the file's path."""
    path = _file(tmp_path, *lines)
    with pytest.raises(DikbenchError) as caught:
        read_poses(path)
    message = str(caught.value)
    assert message.startswith(f"pose file {path}")
    assert words in message
    assert "\n" not in message


def test_a_file_that_is_missing_or_no_text_is_an_error_of_one_line(tmp_path: Path) -> None:
    """A folder, a path that is too long, bytes that are no UTF-8."""
    for path in (str(tmp_path), str(tmp_path / "nowhere.csv"), "x" * 5000):
        with pytest.raises(DikbenchError, match="pose file not found"):
            read_poses(path)
    binary = tmp_path / "image.csv"
    binary.write_bytes(b"\xff\xfe\x00\x01\x80")
    with pytest.raises(DikbenchError, match="is not a CSV file") as caught:
        read_poses(str(binary))
    assert "\n" not in str(caught.value)
