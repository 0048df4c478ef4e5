"""A trial's id holds the source of its law and of what the law shares, and nothing else."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from dikbench.plugins.finding import Plugin, formulation_plugin
from dikbench.plugins.source import digest_of_file, source_digest

CHECKOUT = Path(__file__).parents[3]

# The digests as they are, then with one module after the other edited.
DIGESTS = """
import json, sys
from pathlib import Path
from dikbench.plugins.finding import plugins
from dikbench.plugins.source import digest_of_file, source_digest

def digests():
    digest_of_file.cache_clear()
    return {kind: {name: source_digest(plugin) for name, plugin in plugins(kind).items()}
            for kind in ("formulation", "scenario")}

found = {"": digests()}
for module in sys.argv[1:]:
    file = Path(module.replace(".", "/") + ".py")
    text = file.read_text()
    file.write_text(text + "# changed")
    found[module] = digests()
    file.write_text(text)
print(json.dumps(found))
"""

# What Python itself loads for each module of a package, whose own table loads nothing here.
LOADED = """
import importlib, json, sys, types
from pathlib import Path
found = {}
for package in ("formulations", "scenarios"):
    bare = types.ModuleType(package)
    bare.__path__ = [package]
    for file in Path(package).glob("*.py"):
        for name in [name for name in sys.modules if name.partition(".")[0] == package]:
            del sys.modules[name]
        sys.modules[package] = bare
        if file.stem != "__init__":
            importlib.import_module(f"{package}.{file.stem}")
            loaded = [name for name in sys.modules if name.startswith(package + ".")]
            found[str(file.resolve())] = loaded
print(json.dumps(found))
"""

FILES = """
import json
from dikbench.plugins.finding import plugins
print(json.dumps({kind: {name: plugin.file for name, plugin in plugins(kind).items()}
                  for kind in ("formulation", "scenario")}))
"""


def said(code: str, checkout: Path, *arguments: str) -> Any:
    """What a program prints as JSON in a process that sees this checkout."""
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=checkout,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return json.loads(done.stdout)


def test_a_shared_module_changes_the_laws_that_load_it_and_no_other(tmp_path: Path) -> None:
    """Edited one after the other in a copy, each changes exactly those whose modules load it."""
    for package in ("dikbench", "formulations", "scenarios"):
        shutil.copytree(CHECKOUT / package, tmp_path / package)
    laws = ("saturation", "lu_kernel", "displacement_qp", "manipulability", "lp_alpha", "drake")
    families = ("singular_postures",)
    modules = [*(f"formulations.{m}" for m in laws), *(f"scenarios.{m}" for m in families)]
    digests, loaded = said(DIGESTS, tmp_path, *modules), said(LOADED, tmp_path)
    files = said(FILES, tmp_path)
    for module in modules:
        for kind, before in digests[""].items():
            expected = {name for name, own in files[kind].items() if module in loaded[own]}
            changed = {name for name, old in before.items() if digests[module][kind][name] != old}
            assert changed == expected
            assert bool(expected) == module.startswith(kind)


LAW = """
from dataclasses import dataclass
from .near import far

@dataclass(frozen=True)
class Law:
    def velocity(self, problem, solve):
        return problem.q
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's package with modules that import one another in a circle."""
    name = f"user_{tmp_path.name}"
    folder = tmp_path / name
    (folder / "inner").mkdir(parents=True)
    texts = {
        "__init__.py": "GAIN = 1.0\n",
        "near.py": "from . import far\n",
        "far.py": f"import {name}.near\nfrom .inner import SIDE, deep\n",
        "inner/__init__.py": "from .side import SIDE\n",
        "inner/side.py": "SIDE = 1\n",
        "inner/deep.py": "from .. import GAIN\n",
        "apart.py": "",
        "law.py": LAW,
    }
    for file, text in texts.items():
        (folder / file).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    return folder


def digest_of(package: Path) -> str:
    """The digest of its law, its files read anew."""
    digest_of_file.cache_clear()
    law = importlib.import_module(f"{package.name}.law").Law
    return source_digest(Plugin("law", law, str(package / "law.py")))


@pytest.mark.parametrize(
    ("file", "counts"),
    [
        ("law.py", True),
        ("near.py", True),
        ("far.py", True),
        ("inner/deep.py", True),
        ("inner/__init__.py", True),
        ("inner/side.py", True),
        ("__init__.py", True),
        ("apart.py", False),
    ],
)
def test_modules_of_a_user_s_package(package: Path, file: str, counts: bool) -> None:
    """Relative imports, circles and packages in packages are followed; what is apart is not."""
    before = digest_of(package)
    with (package / file).open("a") as handle:
        handle.write("# changed\n")
    assert (digest_of(package) != before) is counts


def test_a_class_of_a_prompt_has_a_digest() -> None:
    """Without a file there is nothing to read, and no error."""

    class Law:
        def velocity(self, problem: object, solve: object) -> None: ...

    digest = source_digest(Plugin("law", Law, "<stdin>"))
    assert len(digest) == 16


def test_files_of_one_name_in_two_folders_keep_their_sources(tmp_path: Path) -> None:
    """Whichever was loaded last: each plug-in has its own file, and its own digest."""
    text = (
        "from dataclasses import dataclass\n"
        "from dikbench.parameters import Parameters\n"
        "@dataclass(frozen=True)\n"
        "class Law(Parameters):\n"
        "    def velocity(self, problem, solve):\n"
        "        return {factor} * problem.q\n"
    )
    digests: dict[str, set[str]] = {}
    for _ in range(2):
        for folder, factor in (("a", 1), ("b", 2)):
            file = tmp_path / folder / "law.py"
            file.parent.mkdir(exist_ok=True)
            file.write_text(text.format(factor=factor))
            plugin = formulation_plugin(f"{file}:Law")
            assert plugin.file == str(file)
            digests.setdefault(folder, set()).add(source_digest(plugin))
    assert all(len(found) == 1 for found in digests.values())
    assert digests["a"] != digests["b"]
