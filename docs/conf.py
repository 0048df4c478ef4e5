"""The site: `make docs` builds it into docs/_build/html, to be read offline."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "dikbench"
author = "The dikbench developers"
copyright = "The dikbench developers, Apache-2.0"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "site_pages"]

exclude_patterns = ["_build", "*.py"]
source_suffix = {".md": "markdown", ".py": "notebook"}
myst_enable_extensions = ["attrs_block"]
myst_heading_anchors = 3

highlight_language = "none"
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = "dikbench"
html_copy_source = False
html_show_sphinx = False
pygments_style = "friendly"
