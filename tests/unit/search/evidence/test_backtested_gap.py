"""The stated gap: narrower than the loop's where runs allow it, wider where they broke it, or no bound."""

from hashlib import blake2b
from math import inf

import numpy as np
import pytest

from surrogates.analysis.success import SuccessChance
from workbench.report.lines.worst_case import worst_case_lines
from workbench.search.evidence.backtested_gap import UNKNOWN, backtested_gap
from workbench.search.evidence.gap import Gap
from workbench.search.runs.ledger import Ledger
from workbench.search.worst_case import surrogate_worst_case
from workbench.space.box import Parameter, Space

BOX = Space([Parameter("a", lower=0.0, upper=1.0), Parameter("b", lower=0.0, upper=1.0)])
LOOSE = 0.4  # the gap of a loop, in units of the response


def stated(function, points, *, begun, width=LOOSE):
    start = [{"a": a, "b": b, "y": function(a, b)} for a, b in points.tolist()]
    ledger = Ledger.opened(BOX, response="y", sense="max", start=start, progress=None)
    loop = Gap(upper=float(ledger.v.max()) + width, width=width, coverage=0.95, kind="model-based")
    return backtested_gap(loop, ledger, SuccessChance.of(ledger.u, ledger.ok), begun=begun, seed=0), ledger


def wave(a, b):
    return float(np.sin(5 * a) + b * b)  # largest at (pi/10, 1): 2


@pytest.fixture(scope="module")
def points():
    return np.random.default_rng(0).random((24, 2))


def test_a_smooth_response_has_a_narrow_gap_that_covers(points):
    gap, ledger = stated(wave, points, begun=len(points))
    assert ledger.v.max() < 2.0 <= gap.upper
    assert gap.width < 0.5 * float(np.ptp(ledger.v))
    assert gap.upper == pytest.approx(ledger.v.max() + gap.width)


def test_the_gap_of_the_loop_is_never_exceeded(points):
    gap, _ = stated(wave, points, begun=6, width=1e-3)
    assert gap.width == 1e-3


def test_the_doubts_of_the_loop_keep_a_share(points):
    gap, _ = stated(wave, points, begun=len(points), width=50.0)
    assert gap.width == pytest.approx(0.4 * 50.0)


def test_later_runs_beyond_an_earlier_statement_widen_it(points):
    def late(a, b):
        return wave(a, b) + (8.0 if (a, b) in far else 0.0)

    far = {tuple(p) for p in points[18:20].tolist()}
    untested, _ = stated(late, points, begun=len(points), width=10.0)
    tested, _ = stated(late, points, begun=6, width=10.0)
    assert tested.width > 1.5 * untested.width


def test_earlier_statements_that_were_never_needed_narrow_it(points):
    first = points[np.argsort([-wave(a, b) for a, b in points.tolist()])]  # the best run comes first
    untested, ledger = stated(wave, first, begun=len(first))
    tested, _ = stated(wave, first, begun=6)
    margin = 3e-4 * float(np.ptp(ledger.v))
    assert tested.width - margin == pytest.approx(0.7 * (untested.width - margin))


def chance(a, b):
    """A value that says nothing of its neighbours'."""
    return int(blake2b(f"{a:.9f} {b:.9f}".encode(), digest_size=2).hexdigest(), 16) / 65536


def test_where_nothing_is_known_no_bound_is_stated(points):
    gap, _ = stated(chance, points[:14], begun=6)
    assert (gap.width, gap.upper) == (inf, inf)
    assert gap.sentence == f"No bound is known on how much worse it could be: {UNKNOWN}."
    document = gap.to_dict()
    assert (document["width"], document["upper"]) == (None, None)


def test_a_table_that_tells_nothing_says_so_in_the_terminal(points):
    rows = [{"a": a, "b": b, "y": chance(a, b)} for a, b in points[:14].tolist()]
    found = surrogate_worst_case(BOX, rows, response="y")
    assert found.gap.width == inf
    text = " ".join(line.strip() for line in worst_case_lines(found.to_dict()))
    assert "No bound is known on how much worse it could be" in text
