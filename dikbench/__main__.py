"""`python -m dikbench`: the command line."""

from __future__ import annotations

from dikbench.cli import main

if __name__ == "__main__":
    main()
