"""Indices of a study's runs by name: what comes back, and what is refused."""

import numpy as np
import pytest

from workbench.errors import NotEnoughRuns, StudyError
from workbench.screening.indices import indices_document
from workbench.screening.named_methods import INDICES, NAMED_METHODS, named
from workbench.space.box import Space
from workbench.space.parameter import Parameter, Response

SPACE = Space(
    [
        Parameter("k", lower=0, upper=2),
        Parameter("c", lower=1, upper=5),
        Parameter("steel", kind="categorical", levels=["a", "b", "c"]),
        Parameter("paint", lower=0, upper=1),
    ]
)
FORCE = Response("force", unit="N")


def runs(n=40, seed=0):
    rng = np.random.default_rng(seed)
    x = rng.random((n, 4))
    x = SPACE.unit(SPACE.rows(x))
    return x, 4 * x[:, 0] + 2 * x[:, 0] * x[:, 1] + 1.5 * (x[:, 2] == np.unique(x[:, 2])[1])


@pytest.mark.slow
@pytest.mark.parametrize("method", INDICES)
def test_every_method_ranks_what_matters_first(method):
    x, y = runs()
    found = indices_document(method, x, y, SPACE, FORCE)
    assert found["ranking"][0] == "k"
    assert found["n_runs"] == 40
    assert (found["needs"], found["cannot_see"]) == (named(method).needs, named(method).cannot_see)
    assert found["left_out"] == ([] if method in ("sobol", "hsic") else ["steel"])
    assert set(found["indices"]) == set(SPACE.names) - set(found["left_out"])
    assert found == indices_document(method, x, y, SPACE, FORCE)


def test_sobol_indices_by_name_have_bands_and_interactions():
    x, y = runs()
    found = indices_document("sobol", x, y, SPACE, FORCE)
    for row in found["indices"].values():
        for kind in ("main", "total"):
            assert row[f"{kind}_lower"] <= row[kind] <= row[f"{kind}_upper"]
    assert found["interactions"][0]["pair"] == ["k", "c"]
    assert found["indices"]["paint"]["total"] < 0.01
    assert found["q2"] > 0.9
    assert found["averaged_over"]["steel"] == "its 3 levels, equally likely"


@pytest.mark.slow
def test_of_many_parameters_the_first_are_paired():
    space = Space([Parameter(f"x{k}", lower=0, upper=1) for k in range(8)])
    x = np.random.default_rng(1).random((30, 8))
    found = indices_document("sobol", x, x[:, 3] * x[:, 7] + x[:, 0], space, FORCE)
    assert len(found["interactions"]) == 15
    assert found["interactions"][0]["pair"] == ["x3", "x7"]


def test_what_is_refused():
    x, y = runs()
    with pytest.raises(StudyError, match=r"indices need one of sobol, src, .*, got 'fast'"):
        indices_document("fast", x, y, SPACE, FORCE)
    with pytest.raises(NotEnoughRuns, match="src needs at least 8 runs with 'force', got 5"):
        indices_document("src", x[:5], y[:5], SPACE, FORCE)
    with pytest.raises(StudyError, match="hsic of 'force': HSIC needs a response that varies"):
        indices_document("hsic", x, 0 * y, SPACE, FORCE)


def test_every_name_says_what_it_needs_and_cannot_see():
    assert len({one.name for one in NAMED_METHODS}) == len(NAMED_METHODS)
    assert set(INDICES) < {one.name for one in NAMED_METHODS}
    assert all(one.gives and one.needs and one.cannot_see for one in NAMED_METHODS)
