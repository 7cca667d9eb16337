"""Where an adversary's climbs begin, which of them arrive, and what becomes of the rest of the budget."""

import numpy as np
import pytest

from workbench import Parameter, Space
from workbench.models.evaluator import FunctionEvaluator
from workbench.search.evidence.attack.adversary import attack, runs_since


def _cube(d):
    return Space([Parameter(f"x{i}", lower=0, upper=1) for i in range(d)])


def _attack(function, d, **options):
    given = {"value": 10.0, "budget": 150, "seed": 1, **options}
    return attack(FunctionEvaluator(function), _cube(d), **given)


def test_the_first_climbs_begin_at_the_claimed_case():
    claimed = {"x0": 0.3, "x1": 0.7, "x2": 0.45}
    at = np.array([0.3, 0.7, 0.45])

    def hill(x0, x1, x2):
        return -float(((np.array([x0, x1, x2]) - at) ** 2).sum())

    found = _attack(hill, 3, value=hill(**claimed), claimed=claimed)
    climbed = [a for a in found.attempts if a.kind in ("change", "pattern")]
    for kind in ("change", "pattern"):
        first = next(a for a in climbed if a.kind == kind)
        assert np.sum(first.point != at) == 1
    assert not found.is_beaten


def test_climbs_to_one_top_arrive_and_climbs_to_many_do_not():
    one = _attack(lambda x0, x1: x0 + x1, 2)
    assert one.climbs >= one.arrived >= 2
    heights = np.random.default_rng(2).random(400)

    def many(x0, x1):  # a peak of its own height in each of 400 fields
        i, j = min(int(20 * x0), 19), min(int(20 * x1), 19)
        return float(heights[20 * i + j] * np.sin(20 * np.pi * x0) ** 2 * np.sin(20 * np.pi * x1) ** 2)

    several = _attack(many, 2)
    assert several.climbs >= 3
    assert several.arrived < 2


def test_a_climb_from_the_claimed_case_is_no_arrival():
    found = _attack(lambda **x: sum(x.values()), 14, budget=40, claimed={f"x{i}": 1.0 for i in range(14)})
    assert found.arrived <= found.climbs <= 2  # of the four climbs side by side two began at the claim


def test_where_climbs_repeat_each_other_the_budget_fills_empty_places():
    found = _attack(lambda x0, x1: x0 + x1, 2, budget=200)
    assert found.kinds["empty place"] >= 32
    points = np.array([a.point for a in found.attempts])
    grid = np.array([[i, j] for i in range(41) for j in range(41)]) / 40
    holes = np.linalg.norm(grid[:, None] - points[None], axis=2).min(axis=1)
    assert holes.max() < 0.15  # 75 even points of the interior leave holes of 0.2 and more


def test_the_record_and_the_sentence_count_arrivals():
    found = _attack(lambda x0, x1: x0 + x1, 2, value=2.0)
    assert found.to_dict()["arrived"] == found.arrived
    assert f"{found.arrived} of {found.climbs} climbs from elsewhere arrived there" in found.sentence


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_top_of_a_cone_is_met_and_climbs_that_ended_beside_it_count_as_arrived(seed):
    apex = np.array([0.31, 0.62, 0.47, 0.71])

    def cone(**x):
        return float(0.5 - np.linalg.norm(np.array(list(x.values())) - apex))

    found = _attack(cone, 4, value=0.0, budget=1200, seed=seed)
    assert found.largest > 0.499  # climbs that end at a fiftieth of the side leave 2 % and more
    assert found.kinds["fine"] <= 60
    assert found.arrived >= 2
    assert (
        found.since > 400
    )  # the runs after the short steps began: a higher place on one top is no other top


@pytest.mark.parametrize(("gain", "since"), [(0.04, 3), (0.09, 1)])
def test_a_little_more_on_the_same_top_is_no_other_place_and_a_long_way_up_is(gain, since):
    values = np.array([0.0, 1.0, 1.0 + gain / 2, 1.0 + gain, 0.5])
    kinds = ["interior", "pattern", "fine", "fine", "empty place"]
    assert runs_since(values, kinds, 0.9) == since
    assert runs_since(values, ["pattern"] * 5, 0.9) == 1


def _two_peaks(**x):
    u = np.array(list(x.values()))
    broad = np.exp(-((u - 0.7) ** 2).sum() / (2 * 0.4**2))
    narrow = 1.2 * np.exp(-((u - 0.2) ** 2).sum() / (2 * 0.08**2))
    return float(broad + narrow)


def test_a_known_case_on_the_flank_of_a_narrow_peak_is_climbed_to_its_top():
    top = _two_peaks(u=0.2, v=0.2, w=0.2)
    broad = {"x0": 0.7, "x1": 0.7, "x2": 0.7}
    flank = {"x0": 0.27, "x1": 0.14, "x2": 0.25}
    options = {"value": _two_peaks(**broad), "claimed": broad, "budget": 120, "seed": 3}
    blind = _attack(_two_peaks, 3, **options)
    told = _attack(
        _two_peaks, 3, known=[(broad, _two_peaks(**broad)), (flank, _two_peaks(**flank))], **options
    )
    assert told.largest > 0.999 * top > blind.largest
    assert told.kinds["local"] <= 60
    assert told.arrived == 0  # it knew the place: nobody came there from elsewhere


@pytest.mark.parametrize("goes_on", [False, True])
def test_an_attack_that_goes_on_begins_no_climb_at_the_claimed_case(goes_on):
    place = 0.437  # of no drawn case
    record = _attack(
        lambda **x: -sum((v - place) ** 2 for v in x.values()),
        2,
        value=0.0,
        claimed={"x0": place, "x1": place},
        budget=80,
        seed=0,
        goes_on=goes_on,
    )
    beside = [a for a in record.attempts if np.isclose(a.point, place, atol=1e-12).sum() == 1]
    assert bool(beside) != goes_on
    assert record.climbs > 0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_attack_that_has_broken_a_claim_by_enough_stops_at_the_top_next_to_it(sign):
    def signed(**x):
        return sign * _two_peaks(**x)

    broad, flank = {"x0": 0.7, "x1": 0.7, "x2": 0.7}, {"x0": 0.27, "x1": 0.14, "x2": 0.25}
    options = {
        "value": signed(**broad), "claimed": broad, "budget": 300, "seed": 3,
        "sense": "max" if sign > 0 else "min", "known": [(flank, signed(**flank))],
    }  # fmt: skip
    whole = _attack(signed, 3, **options)
    stopped = _attack(signed, 3, enough=signed(**broad) + 0.02 * sign, **options)
    out_of_reach = _attack(signed, 3, enough=9.0 * sign, **options)
    assert whole.runs == out_of_reach.runs == 300
    assert stopped.runs < 250
    assert sign * stopped.largest > 0.999 * _two_peaks(x0=0.2, x1=0.2, x2=0.2)


def test_a_top_among_the_drawn_cases_is_climbed_though_worse_ones_stand_on_another_peak():
    def hidden(x0, x1):
        broad = np.exp(-((x0 - 0.7) ** 2 + (x1 - 0.7) ** 2) / (2 * 0.45**2))
        return float(broad + 0.75 * np.exp(-((x0 - 0.15) ** 2 + (x1 - 0.35) ** 2) / (2 * 0.1**2)))

    claimed = {"x0": 0.7, "x1": 0.7}
    options = {"value": hidden(**claimed), "claimed": claimed, "budget": 100}
    beaten = [_attack(hidden, 2, **options, seed=seed).largest > 1.02 for seed in range(20)]
    assert sum(beaten) >= 11  # climbs from the worst drawn cases, tops or not, beat 5


@pytest.mark.parametrize(("d", "first"), [(4, "pattern"), (8, "change")])
def test_where_every_corner_was_run_climbs_go_inside(d, first):
    slopes = np.random.default_rng(d).normal(size=d)
    found = _attack(lambda **x: float(slopes @ list(x.values())), d)
    kinds = [a.kind for a in found.attempts]
    assert (kinds.count("corner") == 2**d) == (first == "pattern")
    drawn = ("interior", "corner", "near corner")
    assert next(kind for kind in kinds if kind not in drawn) == first
