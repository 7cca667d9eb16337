"""The gap of a mean: over kinked peaks it covers, and where noise hides all it is not stated."""

from math import inf

import numpy as np
import pytest

from workbench.report.lines.worst_case import worst_case_lines
from workbench.search.evidence.mean_gap import HIDDEN
from workbench.search.worst_case import worst_case
from workbench.space.box import Parameter, Space

BOX = Space([Parameter(name, lower=0.0, upper=1.0) for name in "abc"])


def among_noise(function, deviation, seed):
    rng = np.random.default_rng(seed)
    return lambda **x: function(**x) + deviation * rng.standard_normal()


@pytest.fixture(scope="module")
def hidden():
    """A hump over a hundredth of the box, as high as two deviations, that no run has met."""

    def hump(a, b, c):
        return max(0.0, 1.0 - ((a - 0.33) ** 2 + (b - 0.63) ** 2 + (c - 0.37) ** 2) / 0.13**2)

    return worst_case(among_noise(hump, 0.5, 3), BOX, budget=40, seed=0, noise=True)


def test_no_bound_is_stated_where_no_point_tells_of_another(hidden):
    """A bound of a few deviations was stated, of a response that rises by its whole range."""
    assert (hidden.gap.width, hidden.gap.upper) == (inf, inf)
    assert hidden.gap.sentence == f"No bound is known on how much worse it could be: {HIDDEN}."
    assert hidden.interval[0] < hidden.value < hidden.interval[1]


def test_the_document_and_the_terminal_say_so(hidden):
    document = hidden.to_dict()
    assert (document["gap"]["width"], document["gap"]["upper"]) == (None, None)
    text = " ".join(line.strip() for line in worst_case_lines(document))
    assert "No bound is known on how much worse it could be" in text


def test_a_finite_space_that_was_run_whole_keeps_its_bound():
    levels = Space([Parameter("a", kind="discrete", levels=[0.0, 1.0, 2.0])])
    found = worst_case(among_noise(lambda a: (a - 1.0) ** 2, 0.5, 0), levels, budget=30, seed=0, noise=True)
    assert np.isfinite(found.gap.width)


def test_a_model_without_noise_is_told_so_beside_a_bound_that_is_not_known(monkeypatch):
    monkeypatch.setattr("workbench.search.evidence.mean_gap.q2_of_points", lambda *given: 0.0)
    found = worst_case(lambda a, b, c: a + b - c, BOX, budget=25, seed=0, noise=True)
    assert HIDDEN in found.gap.sentence
    assert "noise = false saves runs" in found.gap.sentence
