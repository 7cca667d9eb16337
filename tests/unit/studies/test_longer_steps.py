"""Runs at a longer step beside the true ones: what is counted, and the occupant in a few corners."""

import numpy as np
import pytest

from studies import longer_steps
from studies.longer_steps import compared, main
from studies.occupant_braking import restraint
from workbench.space.box import Parameter, Space
from workbench.study.loading import load_study

SPACE = Space([Parameter(f"x{k}", lower=0.0, upper=1.0 + k) for k in range(8)])


class Sums:
    """The sum of a case; the longer step turns it by `bend`, and one kind of case fails there."""

    response = "y"

    def __init__(self, bend, fails=False):
        self.bend, self.fails = bend, fails

    def responses_of_cases(self, density, cases, *, threads):
        return [{"y": 1.0 + sum(case.values())} for case in cases]

    def coarsened(self, density, cases, *, threads):
        found = [{"y": self.bend(1.0 + sum(case.values()))} for case in cases]
        return [
            ArithmeticError("no run") if self.fails and case["x0"] else one
            for case, one in zip(cases, found, strict=True)
        ]


def test_errors_and_places_are_those_of_the_response():
    near = compared(Sums(lambda y: 1.01 * y), SPACE, np.zeros(1), corners=50, seed=1)
    assert (near.median, near.largest) == (pytest.approx(0.01), pytest.approx(0.01))
    assert near.places[0] == 1
    assert near.failed == 0
    turned = compared(Sums(lambda y: 1.0 / y), SPACE, np.zeros(1), corners=50, seed=1)
    assert min(turned.places) > 40  # the worst stand last


def test_what_fails_is_counted_and_left_out():
    found = compared(Sums(lambda y: y, fails=True), SPACE, np.zeros(1), corners=60, seed=2)
    assert 15 < found.failed < 45
    assert found.largest == 0.0


def test_the_occupant_is_ranked_as_by_true_runs():
    model = restraint(belts=5, airbags=5, steps=500)
    space = load_study(str(longer_steps.files("studies") / longer_steps.STUDIES["occupant"])).space
    density = np.random.default_rng(8).random(model.members)
    found = compared(model, space, density * 10 / density.sum(), corners=40, seed=8)
    assert 0.0 < found.median < 2e-3
    assert found.largest < 0.02
    assert max(found.places[:2]) <= 3
    assert found.failed == 0


def test_every_layout_has_its_line(monkeypatch, capsys):
    monkeypatch.setattr(
        longer_steps, "compared",
        lambda *given, **options: longer_steps.Compared(
            median=1e-4, largest=2e-3, places=(1, 2, 3, 4), failed=0, cost=0.4
        ),
    )  # fmt: skip
    main(10, 2, "occupant")
    assert capsys.readouterr().out.splitlines() == [
        f"{name:8} error 1.0e-04, 2.0e-03   places (1, 2, 3, 4)   cost 0.40   failed 0"
        for name in ("uniform", "drawn 1")
    ]
