"""The design of a study that names no kind, and what is said of one that is poor for its size."""

import numpy as np
import pytest

import doe
from doe.latin.optimised import search_lhs
from workbench.report.lines.design import design_lines
from workbench.sampling.kinds import DEFAULT
from workbench.sampling.plan import DesignOptions, make_design
from workbench.sampling.verdict import cost_of_design
from workbench.space.box import Parameter, Space
from workbench.study.schema import DesignTable

NUMBERS = [Parameter(f"x{k}", lower=0, upper=1) for k in range(8)]
WORDS = [Parameter(f"c{k}", kind="categorical", levels=("red", "green", "blue")) for k in range(3)]


def largest_correlation(unit):
    return doe.max_correlation(unit)


def test_a_study_that_names_no_kind_gets_the_optimised_design():
    assert DesignTable(runs=20).kind == DEFAULT == "optimised_lhs"


def test_it_is_near_the_best_of_either_criterion_and_uncorrelated():
    design = make_design(Space(NUMBERS), DEFAULT, 30, seed=11)
    assert design.options["criterion"] == "phi_p, cd2, correlation"
    assert largest_correlation(design.unit) <= 0.1
    for criterion, measured in (("phi_p", doe.phi_p), ("cd2", doe.cd2)):
        best = min(
            search_lhs(30, 8, criterion=criterion, swaps=400_000, rng=np.random.default_rng(k)).values[
                criterion
            ]
            for k in (1, 2)
        )
        assert measured(design.unit) < 1.03 * best


@pytest.mark.slow
@pytest.mark.parametrize(("runs", "inputs"), [(50, 15), (40, 10), (30, 8)])
def test_at_the_sizes_of_the_quality_table(runs, inputs):
    """Correlation at most 0.1 and below that of 50 random ones, both criteria within 3 % of their best."""
    space = Space([Parameter(f"x{k}", lower=0, upper=1) for k in range(inputs)])
    designs = [make_design(space, DEFAULT, runs, seed=seed).unit for seed in (21, 22, 23)]
    random = [make_design(space, "lhs", runs, seed=k).unit for k in range(50)]
    bound = min(0.1, *(largest_correlation(each) for each in random))
    assert max(largest_correlation(unit) for unit in designs) <= bound
    for criterion, measured in (("phi_p", doe.phi_p), ("cd2", doe.cd2)):
        best = min(
            search_lhs(
                runs, inputs, criterion=criterion, swaps=1_500_000, rng=np.random.default_rng(k)
            ).values[criterion]
            for k in range(3)
        )
        excess = [measured(unit) / best - 1.0 for unit in designs]
        assert max(excess) <= 0.03, (criterion, excess)


def test_words_are_balanced_against_each_other_and_against_the_numbers():
    space = Space([*NUMBERS[:7], *WORDS])
    design = make_design(space, DEFAULT, 40, seed=5)
    random = [make_design(space, "lhs", 40, seed=k).unit for k in range(50)]
    assert largest_correlation(design.unit[:, :7]) <= 0.1
    bound = 0.5 * min(largest_correlation(unit) for unit in random)
    for k in range(len(WORDS)):  # each word beside all numbers
        assert largest_correlation(design.unit[:, [*range(7), 7 + k]]) < bound
    # words beside words enter as their places in the list, an order that the searches know nothing of
    assert largest_correlation(design.unit) < 0.6 * min(largest_correlation(unit) for unit in random)
    for a, b in ((7, 8), (7, 9), (8, 9)):
        pairs = np.histogram2d(design.unit[:, a], design.unit[:, b], bins=3)[0]
        assert pairs.min() >= 3  # 40 / 9 = 4.4


def test_one_criterion_or_several_may_be_named():
    space = Space(NUMBERS[:3])
    for text, kept in (("maxpro", "maxpro"), ("cd2,maxpro", "cd2, maxpro"), ("cd2,  phi_p", "cd2, phi_p")):
        options = DesignOptions(criterion=text, swaps=500)
        assert make_design(space, DEFAULT, 9, options=options).options["criterion"] == kept


def test_a_poor_design_that_is_asked_for_is_kept_with_one_line_that_says_what_it_costs():
    space = Space([Parameter(f"x{k}", lower=0, upper=1) for k in range(15)])
    named = make_design(space, "ihs", 50, seed=1).to_dict()
    sentence = cost_of_design(named)
    assert sentence is not None
    assert "effects of two parameters are hard to tell apart" in sentence
    assert sentence.endswith("It is kept as kind = 'ihs'; without kind it is optimised")
    lines = design_lines(named)
    assert " ".join(line.strip() for line in lines).endswith(f" {sentence}")
    assert max(len(line) for line in lines) <= 80
    better = make_design(space, DEFAULT, 50, seed=1, options=DesignOptions(swaps=50_000)).to_dict()
    assert cost_of_design(better) is None
    assert not any("poor for its size" in line for line in design_lines(better))


def test_a_design_for_a_regression_and_a_table_are_not_judged_by_how_they_fill_the_space():
    space = Space(NUMBERS[:4])
    assert cost_of_design(make_design(space, "d_optimal_select", 12).to_dict()) is None
    assert cost_of_design({"algorithm": "table", "quality": {}}) is None


@pytest.mark.slow
def test_an_optimised_design_may_be_poor_by_its_constraints():
    tied = Space(NUMBERS[:2], ("x0 - x1 <= 0.05", "x1 - x0 <= 0.05"))
    document = make_design(tied, DEFAULT, 12, options=DesignOptions(swaps=300)).to_dict()
    assert "More runs, wider constraints or more swaps would mend it" in (cost_of_design(document) or "")


def test_like_is_compared_with_like():
    # three levels look clustered beside continuous points; beside designs on the same levels they do not
    space = Space([Parameter(f"n{k}", kind="discrete", levels=(1.0, 2.0, 3.0)) for k in range(6)])
    design = make_design(space, "lhs", 30, seed=4)
    among_continuous = doe.quality(design.unit, references=40, rng=np.random.default_rng(1))
    among_alike = design.quality(references=40)
    assert among_continuous.beats("cd2") == 0.0
    assert 5.0 < among_alike.beats("cd2") < 100.0


def test_a_figure_that_says_nothing_has_no_percentile():
    # 4 runs cannot estimate 7 terms: efficiency 0 for every design, which is no 0 % and no 50 %
    found = doe.quality(
        doe.lhs(4, 6, rng=np.random.default_rng(2)), references=5, rng=np.random.default_rng(1)
    )
    assert "d_efficiency" not in found.percentiles
    assert found.to_dict()["d_efficiency"]["percentile"] is None


def test_a_drawn_design_of_another_shape_is_refused():
    with pytest.raises(ValueError, match=r"drawn needs to give designs of shape \(2, 1\), got \(1, 1\)"):
        doe.quality([[0.2], [0.7]], references=1, drawn=lambda _: [[0.5]], rng=np.random.default_rng(1))
