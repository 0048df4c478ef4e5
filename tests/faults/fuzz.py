"""Fuzz study files, selectors and command lines for longer than the tests do.

python tests/faults/fuzz.py --examples 10000
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import pytest


def main() -> None:
    """Run the tests of `tests/dikbench/cli/test_fuzz.py` with more examples."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, default=10_000)
    os.environ["DIKBENCH_FUZZ"] = str(parser.parse_args().examples)
    tests = Path(__file__).parents[1] / "dikbench" / "cli" / "test_fuzz.py"
    sys.exit(pytest.main(["-q", str(tests)]))


if __name__ == "__main__":
    main()
