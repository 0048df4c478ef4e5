"""A package of the user's called `formulations` or `scenarios` breaks nothing in silence."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

MAKE = {
    "formulations": "from dikbench.plugins.building import make_formulation as make; name = 'dls'",
    "scenarios": "from dikbench.plugins.building import make_family as make; name = 'reach'",
}


def run(folder: Path, code: str) -> subprocess.CompletedProcess[str]:
    """Run a script that stands in a folder."""
    script = folder / "script.py"
    script.write_text(code)
    return subprocess.run(
        [sys.executable, str(script)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.mark.parametrize("package", MAKE)
@pytest.mark.parametrize("has_init", [True, False])
def test_a_stray_package_beside_a_script(package: str, has_init: bool, tmp_path: Path) -> None:
    """It is passed over; once it was imported, the error says which folder was found.

    A folder without `__init__.py` is not even imported where dikbench is installed.
    """
    folder = tmp_path / package
    folder.mkdir()
    (folder / "own.py").write_text("VALUE = 3\n")
    if has_init:
        (folder / "__init__.py").write_text("")
    code = (
        f"{MAKE[package]}\n"
        "print(type(make(name)).__module__)\n"  # that of dikbench
    )
    done = run(tmp_path, code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(f"{package}.")
    if not has_init:
        return
    code = (
        f"import {package}.own\n"
        f"{MAKE[package]}\n"
        "from dikbench.errors import DikbenchError\n"
        "try:\n    make(name)\nexcept DikbenchError as error:\n    print(error)\n"
    )
    done = run(tmp_path, code)
    assert done.returncode == 0, done.stderr
    assert str(folder) in done.stdout
    assert f"a folder or module {package!r} of yours hides it: valid: another name" in done.stdout
    assert done.stdout.count("\n") == 1
