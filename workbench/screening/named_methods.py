"""The ways to look at which parameters matter, by the names they have in the field: one table.

Each says what it needs and what it cannot see; the command line, the report and the how-to read it here.
"""

from dataclasses import dataclass

__all__ = ["INDICES", "NAMED_METHODS", "NamedMethod", "named"]


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedMethod:
    """One way: its name on the command line, what it gives, needs, and cannot see."""

    name: str
    gives: str
    needs: str
    cannot_see: str


NAMED_METHODS = (
    NamedMethod(
        name="default",
        gives="the parameters that matter, how many, and down to which share nothing is missing",
        needs="10 + 2 d stored runs of any design",
        cannot_see="parameters below the share that its verdict names; jumps, unless transform is 'ranks'",
    ),
    NamedMethod(
        name="forward",
        gives="the greedy screening of the dissertation, section 3.3, step by step",
        needs="stored runs of any design",
        cannot_see="parameters that pay only together with others",
    ),
    NamedMethod(
        name="welch",
        gives="the screening of Welch et al. 1992, by the full likelihood with free exponents",
        needs="stored runs of any design, up to a few hundred",
        cannot_see="how many parameters matter beyond its stopping rule",
    ),
    NamedMethod(
        name="rivals",
        gives="rankings by regression, random forest, Sobol' indices and likelihood side by side",
        needs="5 stored runs",
        cannot_see="how sure any of them is",
    ),
    NamedMethod(
        name="sobol",
        gives="main and total Sobol' indices and interactions of pairs, with 95 % bands (a Kriging's)",
        needs="about 5 d stored runs of any design, and a response that a Kriging predicts",
        cannot_see="what the Kriging does not predict: jumps, waves shorter than the gaps between runs",
    ),
    NamedMethod(
        name="src",
        gives="standardised regression coefficients, signed, with bootstrap bands",
        needs="d + 4 stored runs; labels are left out",
        cannot_see="whatever is not a straight line: 1 - R2 of the variance",
    ),
    NamedMethod(
        name="srrc",
        gives="standardised regression coefficients of ranks, signed, with bootstrap bands",
        needs="d + 4 stored runs; labels are left out",
        cannot_see="effects that are not monotone, and interactions: 1 - R2 of the variance of the ranks",
    ),
    NamedMethod(
        name="pcc",
        gives="partial correlation coefficients: each parameter freed of the others, signed, with bands",
        needs="d + 4 stored runs; labels are left out",
        cannot_see="whatever is not a straight line; a value near 1 does not say how large the effect is",
    ),
    NamedMethod(
        name="prcc",
        gives="partial rank correlation coefficients, signed, with bootstrap bands",
        needs="d + 4 stored runs; labels are left out",
        cannot_see="effects that are not monotone; a value near 1 does not say how large the effect is",
    ),
    NamedMethod(
        name="hsic",
        gives="R2-HSIC, dependence of any form, with the p-value of independence by permutations",
        needs="about 50 stored runs or more; no model of the response",
        cannot_see="interactions without a main effect; shares of the variance; weak effects in few runs",
    ),
    NamedMethod(
        name="morris",
        gives="elementary effects: mean, mean of absolute values and spread",
        needs="a model that can be run: d + 1 runs of its own for each trajectory; little noise",
        cannot_see="which parameters interact with which; waves that its grid of four levels skips",
    ),
    NamedMethod(
        name="hybrid",
        gives="the default on Morris runs and the stored ones together, and where the two disagree",
        needs="a model that can be run",
        cannot_see="parameters that neither sees",
    ),
)

INDICES = ("sobol", "src", "srrc", "pcc", "prcc", "hsic")
"""The methods of `workbench.screening.indices`."""


def named(name: str) -> NamedMethod:
    """The entry of that name; KeyError for another."""
    return {method.name: method for method in NAMED_METHODS}[name]
