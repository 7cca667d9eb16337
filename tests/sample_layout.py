"""A layout model with a known robust layout: two members, one uncertain direction u in [-1, 1].

    f(a, u) = (1 + u)^2/(0.1 + a0) + 0.25 (1 - u)^2/(0.1 + a1) + 0.001 v,    a0 + a1 <= budget

The worst u is an end of the range; the robust layout makes both ends equal, 0.1 + a0 = 4 (0.1 + a1).
"""

import os
import signal
from pathlib import Path

import numpy as np

from workbench.engine.layout.formulation.problem import InvalidLayout, static_problem
from workbench.stages.campaign import Campaign
from workbench.study.loading import parse_study

ROBUST = 4 * 5 / 4.8  # 4/(0.1 + a0) at a0 = 0.86 with the budget 1


def value(a, u, v):
    return (1 + u) ** 2 / (0.1 + a[0]) + 0.25 * (1 - u) ** 2 / (0.1 + a[1]) + 0.001 * v


def slope(a, u):
    return np.array([-((1 + u) ** 2) / (0.1 + a[0]) ** 2, -0.25 * (1 - u) ** 2 / (0.1 + a[1]) ** 2])


def bare(u, v):
    """The study's own model: no members at all."""
    return {"push": value((0.0, 0.0), u, v)}


class TwoMembers:
    title, response, unit, members = "two members", "push", "N", 2

    def __init__(self, budget=1.0, forbidden=-2.0, unrunnable=-2.0):
        self.budget, self.forbidden, self.unrunnable = budget, forbidden, unrunnable

    def problem(self, scenarios):
        if any(s["u"] < self.forbidden for s in scenarios):
            raise InvalidLayout("this direction is beyond the optimiser")

        def function(a):
            rows = [(value(a, s["u"], s["v"]), slope(a, s["u"])) for s in scenarios]
            return np.array([r[0] for r in rows]), np.array([r[1] for r in rows])

        return static_problem(
            function, start=np.full(2, self.budget / 2), budgets=[(np.ones(2), self.budget)], names=("all",)
        )

    def places(self):
        return ["left", "right"], ["wall"], [(0, 0), (1, 0)]

    def as_response(self, objective):
        return objective

    def responses(self, density, uncertain):
        if uncertain["u"] < self.unrunnable:
            raise RuntimeError("this direction cannot be run")
        stop = os.environ.get("SAMPLE_LAYOUT_STOP")
        if stop is not None:
            place = Path(stop)
            left = int(place.read_text()) - 1
            place.write_text(str(left))
            if left < 0:
                signal.raise_signal(signal.SIGINT)
        return {"push": value(density, **uncertain)}


def two_members(**options):
    return TwoMembers(**options)


STUDY = """
[study]
name = "two"
seed = 3

[model]
kind = "python"
function = "tests.sample_layout:bare"

[[parameter]]
name = "u"
lower = -1
upper = 1

[[parameter]]
name = "v"
lower = 0
upper = 1

[[response]]
name = "push"
unit = "N"

[design]
kind = "lhs"
runs = 12

[evaluate]
engine = "inline"

[screen]
response = "push"

[worst_case]
response = "push"
budget = 6

[robust_layout]
model = "tests.sample_layout:two_members"
nominal = { u = 0.9, v = 0.5 }
scenarios = 4
evaluations = 30
budget = 1300
corners = 8
rounds = 5
samples = 30
"""


def study(folder, text=STUDY):
    """The study in a folder."""
    path = folder / "two.toml"
    path.write_text(text)
    return parse_study(text, path=path)


def run(folder, text=STUDY):
    """The document of its loop, and the folder of its campaign."""
    with Campaign(study(folder, text)) as campaign:
        return campaign.run()["robust_layout"], campaign.folder


def changed(old, new, text=STUDY):
    assert old in text
    return text.replace(old, new)
