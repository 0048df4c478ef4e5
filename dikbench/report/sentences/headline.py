"""Who succeeds most in a situation, in a line."""

from __future__ import annotations

import numpy as np

from dikbench.report.selection.judged import IN_WORDS
from dikbench.report.sentences.findings import Leaders, range_of
from dikbench.report.sentences.words import Names, number, several
from dikbench.statistics.success import ROUNDING, Setting


def headline(leading: Leaders, setting: Setting, cases: int, names: Names) -> str:
    """Say in a line who succeeds most in a situation; empty where nobody can be named.

    Args:
        leading: who is first there, or may be.
        setting: of the rows.
        cases: how many count.
        names: how formulations are called.
    """
    if not leading.contenders:
        return ""
    every = leading.found.contenders.itertuples(index=False, name=None)
    rate_of = dict(zip(every, map(float, leading.found.rate), strict=True))
    most = max(rate_of[contender] for contender in leading.contenders)
    best = [each for each in leading.contenders if rate_of[each] >= most - ROUNDING]
    others = np.array([rate_of[each] for each in leading.contenders if each not in best])
    said = (
        f"{IN_WORDS[setting]}, success of {several(cases, 'case')}: {names.of(best)} with "
        f"{number(100 * most)} %"
    )
    if len(others):
        more = f"{len(others)} {'more' if len(others) > 1 else 'other'}"
        said += f"; {more} ({range_of(others)}) not told apart"
    return f"{said}."
