"""Designs with names, units, identities and provenance, over real factors."""

import json
from importlib.metadata import PackageNotFoundError

import numpy as np
import pytest

import doe
from workbench.errors import StudyError
from workbench.sampling.files import read_design, write_design
from workbench.sampling.kinds import KINDS
from workbench.sampling.plan import (
    Design,
    DesignOptions,
    compare,
    make_design,
    versions,
)
from workbench.space.box import Distribution, Parameter, Space

SEARCHED = DesignOptions(swaps=2000)


@pytest.fixture
def space():
    return Space(
        [Parameter("a", lower=0, upper=2, unit="m"), Parameter("n", kind="integer", lower=1, upper=4)]
    )


@pytest.fixture
def mixed():
    return Space(
        [
            Parameter("grip", lower=350, upper=700, unit="N", step=7),
            Parameter("n", kind="integer", lower=1, upper=4),
            Parameter("hands", kind="binary"),
            Parameter("colour", kind="categorical", levels=("red", "green", "blue")),
            Parameter("size", kind="discrete", levels=(1.0, 2.0, 5.0), unit="mm"),
            Parameter("k", baseline=100.0, factor=(0.5, 2.0), unit="N/m", scale="log"),
            Parameter("v", distribution=Distribution("norm", {"loc": 10.0, "scale": 2.0}), unit="m/s"),
        ]
    )


@pytest.fixture
def plain():
    return Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])


@pytest.mark.parametrize("kind", ["lhs", "ihs", "sobol", "halton", "d_optimal_select", "optimal"])
def test_a_kind_gives_the_runs_asked_for_inside_the_bounds(space, kind):
    design = make_design(space, kind, 12, seed=3)
    assert len(design) == 12
    frame = design.to_pandas()
    assert frame["a"].between(0, 2).all()
    assert set(frame["n"]) <= {1, 2, 3, 4}
    np.testing.assert_array_equal(make_design(space, kind, 12, seed=3).unit, design.unit)
    assert not np.array_equal(make_design(space, kind, 12, seed=4).unit, design.unit)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["lhs", "ihs", "sobol", "halton", "optimised_lhs"])
@pytest.mark.parametrize("runs", [1, 2, 7, 30])
def test_levels_are_balanced_as_far_as_the_runs_allow(mixed, kind, runs):
    options = SEARCHED if kind == "optimised_lhs" else None
    frame = make_design(mixed, kind, runs, seed=1, options=options).to_pandas()
    for p in mixed.parameters:
        if p.levels_count is not None:
            counts = frame[p.name].value_counts().to_numpy()
            if runs >= p.levels_count:
                assert len(counts) == p.levels_count
                assert counts.max() - counts.min() <= 1
            else:
                assert counts.max() == 1
    assert frame["grip"].isin(np.arange(350, 701, 7)).all()


def test_space_filling_designs_follow_a_distribution_and_the_log_scale(mixed):
    frame = make_design(mixed, "lhs", 400, seed=1).to_pandas()
    assert frame["v"].std() == pytest.approx(2.0, abs=0.1)
    assert np.median(frame["k"]) == pytest.approx(100.0, rel=0.01)


def test_factors_are_arranged_together_not_rounded_afterwards(mixed):
    rounded = make_design(mixed, "lhs", 40, seed=1)
    joint = make_design(mixed, "optimised_lhs", 40, seed=1, options=DesignOptions(swaps=20_000))
    assert doe.phi_p(joint.unit) < doe.phi_p(rounded.unit)
    for j in range(5):
        np.testing.assert_array_equal(np.sort(joint.unit[:, j]), np.sort(rounded.unit[:, j]))


@pytest.mark.slow
def test_d_optimal_swaps_keep_the_levels(space):
    design = make_design(space, "d_optimal_within", 16, seed=1, options=SEARCHED)
    assert design.to_pandas()["n"].value_counts().to_dict() == {1: 4, 2: 4, 3: 4, 4: 4}
    assert doe.max_correlation(design.unit) < 0.02


@pytest.mark.parametrize(
    ("constraints", "balanced"),
    [
        (("grip + 100 * n <= 900", "not (colour == 'red' and hands == 1)"), True),
        (("grip + 100 * n <= 700",), False),
    ],
)
@pytest.mark.parametrize("kind", ["lhs", "ihs", "sobol", "d_optimal_select", "optimised_lhs"])
def test_constraints_are_met_by_every_run(mixed, kind, constraints, balanced):
    constrained = Space(mixed.parameters, constraints)
    options = SEARCHED if kind == "optimised_lhs" else None
    design = make_design(constrained, kind, 24, seed=2, options=options)
    assert len(design) == 24
    assert constrained.feasible(design.unit).all()
    if balanced and kind in ("lhs", "ihs", "optimised_lhs"):
        assert design.to_pandas()["n"].value_counts().to_dict() == {1: 6, 2: 6, 3: 6, 4: 6}


def test_constraints_against_the_strata_choose_from_the_feasible_part(plain):
    half = Space(plain.parameters, ("a + b <= 1",))
    for kind in ("lhs", "optimised_lhs", "d_optimal_within"):
        options = None if kind == "lhs" else SEARCHED
        assert half.feasible(make_design(half, kind, 20, options=options).unit).all()
    assert len(make_design(half, "grid", None, options=DesignOptions(levels=4))) == 10


def test_words_enter_a_model_as_contrasts(mixed):
    design = make_design(mixed, "d_optimal_select", 40, options=DesignOptions(model="interactions", pool=600))
    assert set(design.to_pandas()["colour"]) == {"red", "green", "blue"}
    two = Space([Parameter("s", kind="binary"), Parameter("x", lower=0, upper=1)])
    quadratic = make_design(two, "optimal", 6, options=DesignOptions(model="quadratic", criterion="I"))
    assert set(quadratic.to_pandas()["s"]) == {0, 1}


def test_a_grid_takes_all_levels_and_even_steps(space):
    design = make_design(space, "grid", None, options=DesignOptions(levels=3))
    assert len(design) == 12
    assert sorted(set(design.to_pandas()["a"])) == [0, 1, 2]
    assert len(make_design(space, "grid", 21)) == 20


@pytest.mark.parametrize(
    ("kind", "d", "options", "runs"),
    [
        ("factorial", 3, DesignOptions(), 8),
        ("factorial", 2, DesignOptions(levels=4), 16),
        ("fractional", 7, DesignOptions(), 8),
        ("fractional", 5, DesignOptions(resolution=5), 16),
        ("plackett_burman", 11, DesignOptions(), 12),
        ("central_composite", 3, DesignOptions(alpha="faced", centre=2), 16),
        ("box_behnken", 6, DesignOptions(centre=1), 49),
    ],
)
def test_classical_designs_take_no_number_of_runs(kind, d, options, runs):
    box = Space([Parameter(f"x{k}", lower=-1, upper=1) for k in range(d)])
    assert len(make_design(box, kind, None, options=options)) == runs
    assert len(make_design(box, kind, runs, options=options)) == runs


def test_tables_carry_units_identities_and_provenance(space):
    design = make_design(space, "sobol", 5, seed=7)
    dataset = design.to_xarray()
    assert dataset["a"].attrs["units"] == "m"
    assert list(dataset["run"].values) == ["r0001", "r0002", "r0003", "r0004", "r0005"]
    assert dataset["unit_value"].dims == ("run", "parameter")
    assert dataset.attrs["seed"] == 7
    assert dataset.attrs["space_hash"] == space.hash
    assert "version_numpy" in dataset.attrs
    assert design.to_pandas().attrs["units"] == {"a": "m", "n": "1"}
    document = json.loads(json.dumps(design.to_dict(), allow_nan=False))
    assert document["n"] == 5
    assert document["parameters"][0]["unit"] == "m"
    assert set(document["quality"]["cd2"]) == {"value", "percentile", "better"}
    np.testing.assert_allclose(design.coded, 2 * design.unit - 1)
    again = Design.from_dict(document)
    np.testing.assert_array_equal(again.unit, design.unit)
    assert again.run_ids == design.run_ids


def test_a_csv_with_its_side_car_brings_the_design_back(mixed, tmp_path):
    design = make_design(mixed, "lhs", 9, seed=1).blocked(3, seed=1)
    path = write_design(design, tmp_path / "plan.csv")
    again = read_design(path)
    np.testing.assert_array_equal(again.unit, design.unit)
    assert (again.run_ids, again.block, again.space.hash) == (design.run_ids, design.block, mixed.hash)
    lines = path.read_text().splitlines()
    assert lines[0] == "run_id,block,grip,n,hands,colour,size,k,v"
    path.write_text("\n".join([lines[0], lines[4], lines[2]]) + "\n")
    assert read_design(path).run_ids == ("r0004", "r0002")
    path.write_text("\n".join([lines[0], lines[1].replace("r0001", "r0099")]) + "\n")
    with pytest.raises(StudyError, match=r"line 2: run 'r0099' is not in plan.csv.json"):
        read_design(path)
    cells = lines[1].split(",")
    cells[2] = "1"
    path.write_text("\n".join([lines[0], ",".join(cells)]) + "\n")
    with pytest.raises(StudyError, match=r"line 2: grip is '1', plan\.csv\.json has"):
        read_design(path)
    with pytest.raises(
        StudyError, match=r"other\.csv is missing; a design is a CSV and the \.json beside it"
    ):
        read_design(tmp_path / "other.csv")


def test_versions_name_a_package_that_is_not_installed(monkeypatch):
    def missing(name):
        raise PackageNotFoundError(name)

    monkeypatch.setattr("workbench.sampling.plan.version", missing)
    versions.cache_clear()
    assert set(versions().values()) == {"not installed"}
    versions.cache_clear()


def test_runs_keep_their_ids_through_every_verb(space):
    design = make_design(space, "lhs", 10, seed=1)
    assert design.subset(["r0003", 0]).run_ids == ("r0003", "r0001")
    shuffled = design.randomised(seed=2)
    assert sorted(shuffled.run_ids) == list(design.run_ids)
    place = shuffled.run_ids.index("r0004")
    np.testing.assert_array_equal(shuffled.unit[place], design.unit[3])
    twice = shuffled.replicated(2)
    assert twice.run_ids[:10] == shuffled.run_ids
    assert twice.run_ids[10:] == tuple(f"r{k:04d}" for k in range(11, 21))
    np.testing.assert_array_equal(twice.unit[10:], shuffled.unit)
    more = design.grown(6, seed=1)
    assert more.run_ids[:10] == design.run_ids
    np.testing.assert_array_equal(more.unit[:10], design.unit)
    counts = more.to_pandas()["n"].value_counts()
    assert counts.max() - counts.min() <= 1


def test_growth_for_a_model_is_better_than_random_growth(plain):
    design = make_design(plain, "lhs", 8, seed=1)
    grown = design.grown(6, seed=1, model="quadratic")
    random = np.vstack([design.unit, np.random.default_rng(0).random((6, 2))])
    assert doe.d_efficiency(grown.unit, model="quadratic") > doe.d_efficiency(random, model="quadratic")


@pytest.mark.parametrize(("runs", "more"), [(12, 12), (10, 7)])
def test_a_latin_hypercube_grows_into_one_and_levels_stay_balanced(mixed, runs, more):
    design = make_design(mixed, "lhs", runs, seed=2)
    grown = design.grown(more, seed=1)
    np.testing.assert_array_equal(grown.unit[:runs], design.unit)
    for j, name in enumerate(mixed.names):
        levels = mixed.unit_levels[j]
        if levels is not None:
            counts = grown.to_pandas()[name].value_counts()
            assert counts.max() - counts.min() <= (1 if (runs + more) % len(levels) == 0 else 2), name
        elif more == runs and mixed.parameters[j].distribution is None:
            strata = np.sort(np.floor(grown.unit[:, j] * (runs + more)))
            np.testing.assert_array_equal(strata, np.arange(runs + more), err_msg=name)


def test_growth_meets_constraints(mixed):
    constrained = Space(mixed.parameters, ("grip + 100 * n <= 900",))
    grown = make_design(constrained, "lhs", 10).grown(10, seed=3)
    assert constrained.feasible(grown.unit).all()
    assert len(np.unique(grown.unit, axis=0)) == 20


def test_blocks_are_of_one_size_and_alike(plain):
    design = make_design(plain, "lhs", 20, seed=5)
    blocked = design.blocked(3, seed=1)
    sizes = np.bincount(blocked.block)[1:]
    assert sorted(sizes.tolist()) == [6, 7, 7]
    number = np.array(blocked.block)
    spread = np.ptp([design.unit[number == b].mean(axis=0) for b in (1, 2, 3)], axis=0).max()
    rng = np.random.default_rng(0)
    luck = []
    for _ in range(50):
        other = rng.permutation(number)
        luck.append(np.ptp([design.unit[other == b].mean(axis=0) for b in (1, 2, 3)], axis=0).max())
    assert spread < min(luck)
    ordered = blocked.randomised(seed=1)
    assert list(ordered.block) == sorted(ordered.block)


def test_compare_puts_designs_side_by_side(plain):
    designs = {k: make_design(plain, k, 15, seed=1) for k in ("lhs", "d_optimal_select")}
    table = compare(designs)
    assert list(table.columns.get_level_values(0)) == ["lhs", "lhs", "d_optimal_select", "d_optimal_select"]
    d = table.xs("value", axis=1, level=1).loc["d_efficiency"]
    assert d["d_optimal_select"] > d["lhs"]
    assert (table.xs("better than", axis=1, level=1).fillna(0) <= 100).all(axis=None)
    with pytest.raises(StudyError, match="designs of the same algorithm need names"):
        compare([designs["lhs"], designs["lhs"]])
    with pytest.raises(StudyError, match="compare needs at least one design"):
        compare([])


def over(*parameters, constraints=()):
    return Space([Parameter("a", lower=0, upper=1), *parameters], constraints)


OTHER = Parameter("b", lower=0, upper=1)
WORDS = Parameter("w", kind="categorical", levels=("x", "y", "z"))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: make_design(s, "hypercube", 5), "design kind needs one of lhs, .*got 'hypercube'"),
        (lambda s: make_design(s, "sobol", 0), "design kind 'sobol' needs runs >= 1, got 0"),
        (lambda s: make_design(s, "lhs", 5, options=DesignOptions(pool=50)), "'lhs' does not take 'pool'"),
        (lambda s: make_design(s, "grid", None), "'grid' needs levels"),
        (lambda s: make_design(s, "grid", 3), "leaves no two levels for 1 continuous parameters"),
        (
            lambda s: make_design(s, "grid", 3, options=DesignOptions(levels=2)),
            "the grid has 8 runs, more than runs = 3",
        ),
        (lambda s: make_design(s, "d_optimal_select", 2), "n=2 runs cannot estimate the 3 terms"),
        (
            lambda s: make_design(s, "d_optimal_select", 9, options=DesignOptions(pool=5)),
            "pool needs at least runs = 9 points",
        ),
        (
            lambda s: make_design(s, "d_optimal_select", 9, options=DesignOptions(model="cubic")),
            "model is one of linear, interactions, quadratic, got 'cubic'",
        ),
        (
            lambda s: make_design(s, "optimised_lhs", 9, options=DesignOptions(criterion="best")),
            "design kind 'optimised_lhs': criterion needs phi_p, cd2",
        ),
        (lambda s: make_design(s, "factorial", 9), "'factorial' has 8 runs here, got runs = 9"),
        (lambda s: make_design(s, "central_composite", None), "parameter 'n' has 4 levels, none at"),
        (lambda s: make_design(over(WORDS), "plackett_burman", None), "parameter 'w' has 3 words"),
        (lambda s: make_design(over(WORDS), "d_optimal_within", 9), "does not know words with three"),
        (
            lambda s: make_design(over(constraints=("a < -1",)), "lhs", 5),
            r"no feasible point of 65536 tried: 'a < -1' holds in 0.00%.*tightest is 'a < -1'",
        ),
        (
            lambda s: make_design(
                Space([Parameter("n", kind="integer", lower=1, upper=9)], ("n <= 3",)), "lhs", 5
            ),
            "leave 3 different feasible points of 65536 tried",
        ),
        (
            lambda s: make_design(
                Space([Parameter("n", kind="integer", lower=1, upper=9)], ("n <= 3",)), "d_optimal_select", 5
            ),
            "the pool holds 3 different feasible points, 5 runs are asked for",
        ),
        (
            lambda s: make_design(
                over(Parameter("b", lower=0, upper=1), constraints=("a + b < 1.5",)), "fractional", None
            ),
            "'fractional': 1 of 4 runs break the constraints, the first 'a \\+ b < 1.5'",
        ),
        (lambda s: Design(space=s, unit=[[0, 0]], run_ids=(), algorithm="x"), "one run id per run, got 0"),
        (lambda s: Design(space=s, unit=[[0, 0]] * 2, run_ids=("a", "a"), algorithm="x"), "given twice"),
        (
            lambda s: Design(space=s, unit=[[0, 0]], run_ids=("a",), algorithm="x", block=(1, 2)),
            "one block per run, got 2 for 1",
        ),
        (
            lambda s: make_design(s, "lhs", 5).subset(["r0009"]),
            "no run 'r0009'; it has 5, from r0001 to r0005",
        ),
        (lambda s: make_design(s, "lhs", 5).replicated(0), "times needs a whole number >= 1, got 0"),
        (
            lambda s: make_design(s, "lhs", 5).blocked(6, seed=1),
            "blocks needs a whole number from 1 to the 5",
        ),
        (lambda s: make_design(s, "lhs", 5).grown(0, seed=1), "runs needs a whole number >= 1, got 0"),
        (
            lambda s: make_design(Space([Parameter("b", kind="binary")]), "lhs", 2).grown(
                5, seed=1, model="linear"
            ),
            "the space holds 2 different feasible points, 5 more are asked for",
        ),
    ],
)
def test_bad_input_says_what_to_do(space, call, message):
    with pytest.raises(StudyError, match=message):
        call(space)


def test_every_option_belongs_to_a_kind():
    options = set(DesignOptions.__dataclass_fields__)
    assert options == {name for kind in KINDS.values() for name in kind.options}
