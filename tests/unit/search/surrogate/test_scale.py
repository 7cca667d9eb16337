"""The scale on which a search models its response: by name or chosen, with the reason, in its own unit."""

import numpy as np
import pytest

from workbench.errors import StudyError
from workbench.search.arguments import Arguments
from workbench.search.surrogate.fitting import fit_search_model
from workbench.search.surrogate.scale import used_scale
from workbench.search.worst_case import surrogate_worst_case, worst_case
from workbench.space.box import Parameter, Space

BOX = Space([Parameter(name, lower=0.0, upper=1.0) for name in "abc"])


def decades(a, b, c):
    return float(np.exp(5 * a - 3 * (b - 0.3) ** 2 + np.sin(3 * c)))


def runs(n=30, seed=2):
    u = np.random.default_rng(seed).random((n, 3))
    return u, np.array([decades(*row) for row in u])


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("scale", ["log", "box-cox", "yeo-johnson"])
def test_a_named_scale_serves_both_senses_in_the_unit_of_the_response(scale, sign):
    u, y = runs()
    model = fit_search_model(u, sign * y, previous=None, seed=0, scale=scale, sign=sign)
    assert model.transform.kind == scale
    new, true = runs(seed=5)
    plain = fit_search_model(u, sign * y, previous=None, seed=0, scale="none", sign=sign)
    error, other = (np.mean((sign * m.mean(new) - true) ** 2) for m in (model, plain))
    assert scale == "yeo-johnson" or error < 0.7 * other
    low, high = model.bound(new, -3.0), model.bound(new, 3.0)
    assert (low <= high).all()
    assert scale == "yeo-johnson" or (sign * low > 0).all()
    assert "as asked" in used_scale(scale, model, sign * y).reason
    # its range grows with the runs, the scale is kept
    again = np.vstack([u, new[:1]]), sign * np.append(y, 2 * y.max())
    kept = fit_search_model(*again, previous=model, seed=0, scale=scale, sign=sign)
    assert kept.transform.kind == scale
    assert kept.transform.map.observed[-1] == 2 * y.max()
    assert kept.best == again[1].max()


def test_a_scale_that_the_runs_do_not_admit_gives_way_and_says_so():
    u, y = runs()
    y[3] = -1.0
    model = fit_search_model(u, y, previous=None, seed=0, scale="log")
    assert model.transform.kind == "identity"
    said = used_scale("log", model, y)
    assert (said.asked, said.used) == ("log", "none")
    assert said.reason.startswith("The response was modelled as it is: 'log' needs it above 0")


def test_one_that_was_admitted_gives_way_when_a_run_turns_negative():
    u, y = runs()
    model = fit_search_model(u, y, previous=None, seed=0, scale="log")
    u, y = np.vstack([u, [[0.5, 0.5, 0.5]]]), np.append(y, -0.1)
    assert fit_search_model(u, y, previous=model, seed=0, scale="log").transform.kind == "identity"


@pytest.mark.slow
def test_the_result_says_which_was_chosen_and_why():
    found = worst_case(decades, BOX, budget=16, seed=0)
    assert found.scale is not None
    assert found.scale.used == "the logarithm of the distance to the mildest value"
    assert "which makes the runs likelier than the response itself does (by " in found.scale.reason
    assert found.scale.unexplained is not None
    assert found.scale.unexplained < 0.05
    assert found.to_dict()["scale"]["asked"] == "auto"
    by_name = worst_case(decades, BOX, budget=12, seed=0, transform="none")
    assert by_name.scale is not None
    assert by_name.scale.reason.startswith("The response was modelled as it is.")


def test_of_given_runs_it_can_be_named_as_well():
    u, y = runs()
    rows = [{**row, "f": value} for row, value in zip(BOX.rows(u), y, strict=True)]
    for sense in ("max", "min"):
        found = surrogate_worst_case(BOX, rows, response="f", sense=sense, transform="log")
        assert found.scale is not None
        assert found.scale.used == "log"
        assert found.value > 0.0


def test_what_no_search_can_use_is_refused():
    with pytest.raises(StudyError, match=r"transform needs one of auto, none, .* got 'ranks'; ranks tell"):
        Arguments(transform="ranks")
    with pytest.raises(StudyError, match=r"transform='log' does not go with noise=True: the mean is"):
        Arguments(transform="log", noise=True)


def test_a_kriging_that_explains_nothing_is_told_so_and_not_in_per_cent_beyond_a_hundred():
    u = np.random.default_rng(0).random((12, 3))
    said = []
    for seed in range(8):
        noise = np.random.default_rng(seed).standard_normal(12)
        model = fit_search_model(u, noise, previous=None, seed=0, scale="none")
        told = used_scale("none", model, noise)
        left_out = "Where runs are left out the Kriging of all parameters"
        nothing = f"{left_out} explains none of the response's variance."
        some = f"{left_out} leaves {100 * told.unexplained:.3g} % of the response's variance unexplained."
        assert (told.unexplained >= 1.0) == told.reason.endswith(nothing)
        assert (told.unexplained < 1.0) == told.reason.endswith(some)
        said.append(told.unexplained >= 1.0)
    assert any(said)
