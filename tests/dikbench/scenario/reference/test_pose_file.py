"""Files of target poses: what is read, and what is said about every way to write one wrong."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from dikbench.errors import DikbenchError
from dikbench.scenario.reference.pose_file import read_poses

POSES = Path(__file__).parents[3] / "data" / "poses"
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


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize(
    "header",
    [
        "t,x,y,z,qx,qy,qz,qw",
        "t ,x , y,z ,qx,qy,qz,qw ",
        "t,x,y,z,qx,qy,qz,qw,,",
        '"t","x","y","z","qx","qy","qz","qw"',
        "# t,x,y,z,qx,qy,qz,qw",
    ],
)
def test_a_file_is_the_same_however_it_is_written(
    header: str, end: str, separator: str, tmp_path: Path
) -> None:
    """Separators, line ends, blanks, quotes, comments; lines are counted as an editor does."""
    text = ["# by a recorder; rev, 2", header, FIRST, "", "  # paused, here", "0.25,1,2,3,0,0,0,1,"]
    path = tmp_path / "poses.csv"
    path.write_bytes(("\ufeff" + end.join(text)).replace(",", separator).encode())
    poses = read_poses(str(path))
    assert poses.times == (0.0, 0.25)
    assert poses.lines == (3, 6)
    assert poses.placements[1].translation.tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("origin", ["1700000000", "-86400", "1e15", "123456789012345678"])
def test_the_first_time_is_subtracted_before_digits_are_lost(origin: str, tmp_path: Path) -> None:
    """Stamps of any clock, to the nanosecond."""
    seconds = Decimal(origin)
    later = [seconds + Decimal(text) for text in ("0.000000001", "0.1", "0.3", "7.000000001")]
    rows = [f"{stamp:f},0,0,0,0,0,0,1" for stamp in (seconds, *later)]
    poses = read_poses(_file(tmp_path, HEADER, *rows))
    assert poses.times == (0.0, 1e-9, 0.1, 0.3, 7.000000001)


@pytest.mark.parametrize("name", ["comment_first", "header_trailing", "semicolon"])
def test_files_that_people_bring_are_read(name: str) -> None:
    """41 rows over four seconds, whatever is written about them."""
    poses = read_poses(str(POSES / f"{name}.csv"))
    assert (len(poses.times), poses.times[-1]) == (41, 4.0)
    assert poses.placements[1].translation.tolist() == [0.562710348, 0.315476674, 0.320737873]


def test_a_column_that_stands_twice_is_refused_with_the_header() -> None:
    """Not taken from one of the two."""
    with pytest.raises(DikbenchError, match="column 'x' stands twice; the header is 't,x,y,z,qx"):
        read_poses(str(POSES / "dup_col.csv"))


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["time,x,y"], "no column 't'; expected: t,x,y,z,qx,qy,qz,qw; the header is 'time,x,y'"),
        (["t x y z qx qy qz qw"], "the header is 't x y z qx qy qz qw'"),
        (["# by a recorder", "0,1,2"], "the header is '0,1,2'"),
        ([HEADER, FIRST, "0,5,0,0,0,0,0,0,0,1"], "line 3: 10 values; the header has 8 columns"),
        (
            [HEADER.replace(",", ";"), FIRST.replace(",", ";"), "0,5,1;0;0;0;0;0;0;1"],
            "line 3: t='0,5,1' is not a finite number",
        ),
        ([HEADER, FIRST, "1e-10,0,0,0,0,0,0,1"], "line 3: t=1e-10 is less than 1 ns after 0"),
        ([HEADER, FIRST, "1e400,0,0,0,0,0,0,1"], "line 3: t='1e400' is not a finite number"),
        ([HEADER, FIRST, f"1e-{10**30},0,0,0,0,0,0,1"], "is not a finite number"),
        ([HEADER, FIRST, "1,1e300,0,0,0,0,0,1"], "line 3: x=1e+300 must be within 1e+06 m"),
        ([HEADER, FIRST, "1,0,0,0,0,0,0,1e300"], "line 3: the quaternion's norm is 1e+300"),
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


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16", "cp1252"])
@pytest.mark.parametrize("separator", [";", "\t"])
def test_what_a_spreadsheet_writes_is_understood(
    encoding: str, separator: str, tmp_path: Path
) -> None:
    """Its encodings, a note with an umlaut, and decimal commas where no comma separates."""
    lines = [
        "t,x,y,z,qx,qy,qz,qw,Prüfer",
        "0|0,-1|5,|25,1e-3,0,0,0,1,Jörg",
        "0|5,1,2,3|5e-1,0,0,0,1,",
    ]
    text = "\r\n".join(lines).replace(",", separator).replace("|", ",")
    path = tmp_path / "poses.csv"
    path.write_bytes(text.encode(encoding))
    poses = read_poses(str(path))
    assert poses.times == (0.0, 0.5)
    assert poses.placements[0].translation.tolist() == [-1.5, 0.25, 1e-3]
    assert poses.placements[1].translation.tolist() == [1.0, 2.0, 0.35]


def test_decimal_commas_between_commas_are_explained(tmp_path: Path) -> None:
    """They make more values than columns; between semicolons 1,234,5 is no number either."""
    between = _file(tmp_path, HEADER, "0,0,0,3,0,5,0,1,0,0,0,0")
    with pytest.raises(DikbenchError, match=r"12 values.*numbers such as 0,5 need ; between them"):
        read_poses(between)
    thousands = _file(tmp_path, HEADER.replace(",", ";"), "0;1,234,5;0;0;0;0;0;1")
    with pytest.raises(DikbenchError, match=r"line 2: x='1,234,5' is not a finite number"):
        read_poses(thousands)
