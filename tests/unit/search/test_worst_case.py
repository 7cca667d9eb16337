"""The search for the worst case: confirmed by true runs, resumable, honest about what it does not know."""

import itertools

import numpy as np
import pytest

from workbench.errors import StudyError
from workbench.models.evaluator import FunctionEvaluator, Outcome
from workbench.search.arguments import Arguments
from workbench.search.evidence.gap import lipschitz_gap
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.worst_case import (
    Status,
    search_worst_case,
    surrogate_worst_case,
    worst_case,
)
from workbench.space.box import Parameter, Space

BOX = Space([Parameter("a", lower=-1.0, upper=2.0, unit="m"), Parameter("b", lower=0.0, upper=1.0)])


def bowl(a, b):
    return a * a - b


def bump(a, b):
    return -((a - 0.3) ** 2) - (b - 0.7) ** 2


@pytest.fixture(scope="module")
def found():
    return worst_case(bowl, BOX, budget=14, seed=0)


def test_a_corner_is_found_and_belongs_to_a_true_run(found):
    assert found.value == 4.0
    assert found.parameters == {"a": 2.0, "b": 0.0}
    assert found.confirmed
    assert found.label == "confirmed by a true run"
    assert bowl(**found.parameters) == found.value


def test_an_interior_worst_case_is_found():
    result = worst_case(bump, BOX, budget=30, seed=1)
    assert result.value == pytest.approx(0.0, abs=1e-3)
    assert result.parameters["a"] == pytest.approx(0.3, abs=0.03)


def test_small_is_bad():
    result = worst_case(bowl, BOX, sense="min", budget=25, seed=0)
    assert result.value == pytest.approx(-1.0, abs=1e-3)
    assert result.history.min() == result.value


def test_history_holds_true_values_in_the_order_run(found):
    numbers = [run.number for run in found.runs]
    assert numbers == list(range(1, len(numbers) + 1))
    assert found.history.tolist() == [bowl(**run.parameters) for run in found.runs]
    assert found.evaluations == len(found.history) <= 14


def test_the_document_holds_what_the_report_reads(found):
    document = found.to_dict()
    assert document["value"] == 4.0
    assert document["history"][-1]["best"] == 4.0
    assert document["gap"]["kind"] == "model-based"
    assert set(document["profile"]) == {"a", "b"}
    assert len(document["profile"]["a"]["x"]) == len(document["profile"]["a"]["mean"])
    assert document["audit"]["corners"] == 4


def test_the_same_seed_repeats_and_another_differs(found):
    again = worst_case(bowl, BOX, budget=14, seed=0)
    assert [r.parameters for r in again.runs] == [r.parameters for r in found.runs]
    other = worst_case(bowl, BOX, budget=14, seed=1)
    assert [r.parameters for r in other.runs] != [r.parameters for r in found.runs]


def test_an_interrupted_search_repeats_no_run():
    calls = []

    def counted(a, b):
        calls.append((a, b))
        if len(calls) == 7:
            raise KeyboardInterrupt
        return bowl(a, b)

    evaluate = FunctionEvaluator(counted)
    with pytest.raises(KeyboardInterrupt):
        search_worst_case(evaluate, BOX, Arguments(budget=12, seed=3))
    resumed = search_worst_case(evaluate, BOX, Arguments(budget=12, seed=3))
    plain = worst_case(bowl, BOX, budget=12, seed=3)
    assert [r.parameters for r in resumed.runs] == [r.parameters for r in plain.runs]
    assert len(calls) == resumed.evaluations + 1  # the interrupted one, and none twice


def test_a_batch_interrupted_in_the_middle_is_finished_and_not_drawn_anew():
    calls = []

    def counted(a, b):
        calls.append((a, b))
        if len(calls) == 6:  # the second of the first batch of three
            raise KeyboardInterrupt
        return bump(a, b)

    evaluate = FunctionEvaluator(counted)
    with pytest.raises(KeyboardInterrupt):
        search_worst_case(evaluate, BOX, Arguments(budget=13, seed=2, workers=3, tolerance=-1))
    interrupted = calls[5]
    resumed = search_worst_case(evaluate, BOX, Arguments(budget=13, seed=2, workers=3, tolerance=-1))
    assert calls[6] == interrupted
    assert len(calls) == 13 + 1
    plain = search_worst_case(
        FunctionEvaluator(bump), BOX, Arguments(budget=13, seed=2, workers=3, tolerance=-1)
    )
    assert [r.parameters for r in resumed.runs] == [r.parameters for r in plain.runs]


def test_an_uncertainty_without_parameters_is_refused():
    with pytest.raises(StudyError, match="a space needs at least one parameter"):
        worst_case(bowl, Space([]))


def test_given_runs_cost_nothing_and_are_used():
    rng = np.random.default_rng(0)
    rows = BOX.rows(rng.random((12, 2)))
    start = [
        Outcome(parameters=row, status="ok", outputs={"y": bowl(**row)}, key=f"s{i}")
        for i, row in enumerate(rows)
    ]
    result = worst_case(bowl, BOX, budget=6, seed=0, start=start)
    assert result.evaluations <= 6
    assert result.value == 4.0
    assert [run.number for run in result.runs[:12]] == [0] * 12


def test_batches_are_as_large_as_the_workers():
    sizes = []

    class Spy(FunctionEvaluator):
        __slots__ = ()

        def __call__(self, rows, *, purpose):
            sizes.append(len(rows))
            return super().__call__(rows, purpose=purpose)

    result = search_worst_case(Spy(bump), BOX, Arguments(budget=16, seed=0, workers=3, tolerance=-1))
    assert sizes[0] == 4  # d + 2
    assert set(sizes[1:]) <= {1, 2, 3}
    assert 3 in sizes
    assert result.evaluations == 16


MIXED = Space(
    [
        Parameter("force", lower=350.0, upper=700.0, unit="N", step=7.0),
        Parameter("hands", kind="binary"),
        Parameter("road", kind="categorical", levels=("dry", "wet", "ice")),
        Parameter("speed", lower=0.0, upper=1.0),
    ]
)


def mixed(force, hands, road, speed):
    friction = {"dry": 1.0, "wet": 0.6, "ice": 0.2}[road]
    return (speed - 0.4) ** 2 / friction - hands + abs(force - 371.0) / 700.0


@pytest.mark.slow
def test_mixed_spaces_stay_on_their_levels_and_find_the_best_combination():
    result = worst_case(mixed, MIXED, sense="min", budget=60, seed=0)
    for run in result.runs:
        assert (run.parameters["force"] - 350.0) % 7.0 == pytest.approx(0.0, abs=1e-9)
        assert run.parameters["hands"] in (0, 1)
    assert result.parameters["hands"] == 1
    assert result.value == pytest.approx(-1.0, abs=0.02)
    assert len(result.audit.combinations) in (0, 6)


def test_a_finite_space_is_exhausted_and_has_no_gap():
    space = Space([Parameter("k", kind="discrete", levels=(1.0, 2.0, 3.0)), Parameter("on", kind="binary")])
    result = worst_case(lambda k, on: k * (1 + on), space, budget=20, seed=0)
    assert result.status is Status.EXHAUSTED
    assert result.evaluations == 6
    assert result.gap.width == 0.0
    assert result.gap.kind == "enumerated"
    assert result.gap.failed == 0


def test_constraints_hold_for_every_run():
    space = Space(BOX.parameters, constraints=("a + b <= 1.5",))
    result = worst_case(bowl, space, budget=20, seed=0)
    assert all(r.parameters["a"] + r.parameters["b"] <= 1.5 for r in result.runs)
    assert result.value == pytest.approx(2.25, rel=0.02)


@pytest.mark.slow
def test_failed_runs_are_data_and_the_search_goes_round_them():
    def brittle(a, b):
        if a > 1.5:
            raise RuntimeError("solver diverged")
        return bowl(a, b)

    result = worst_case(brittle, BOX, budget=40, seed=0)
    assert result.failures.get("failed", 0) >= 1
    assert 1.9 < result.value <= 2.25
    assert result.to_dict()["failures"] == result.failures


def test_not_finite_responses_are_failures():
    result = worst_case(lambda a, b: float("nan") if b > 0.9 else a, BOX, budget=20, seed=0)
    assert set(result.failures) <= {"nonfinite"}
    assert result.value == pytest.approx(2.0)


def test_a_function_of_several_responses_is_searched():
    result = worst_case(
        lambda a, b: {"height": a, "load": b},
        BOX,
        response=lambda out: out["height"] - 2 * out["load"],
        budget=14,
        seed=0,
    )
    assert result.value == 2.0
    assert result.response == "combination"


def test_the_audit_counts_corners_and_reads_monotone_signs():
    result = worst_case(lambda a, b: 3 * a - b, BOX, budget=20, seed=0)
    assert result.audit.is_corner
    assert result.audit.monotone == {"a": "rising", "b": "falling"}
    assert result.audit.corner_consistent
    assert result.audit.corners_run >= 1
    assert any("corner" in sentence for sentence in result.audit.sentences)


def test_the_surrogate_alone_is_labelled_as_unconfirmed():
    rng = np.random.default_rng(1)
    rows = BOX.rows(rng.random((20, 2)))
    runs = [
        Outcome(parameters=row, status="ok", outputs={"y": bowl(**row)}, key=str(i))
        for i, row in enumerate(rows)
    ]
    result = surrogate_worst_case(BOX, runs, seed=0)
    assert not result.confirmed
    assert result.label == "surrogate only, unconfirmed"
    assert result.status is Status.SURROGATE
    assert result.value == pytest.approx(4.0, abs=0.05)
    assert result.parameters["a"] == pytest.approx(2.0)
    assert result.evaluations == 0


def test_a_lipschitz_constant_makes_the_gap_a_certificate():
    # |grad| of a^2 - b in the unit cube: a = 3 u - 1, so (2 a 3, 1) and at most sqrt(144 + 1)
    result = worst_case(bowl, BOX, budget=40, seed=0, lipschitz=np.sqrt(145.0), tolerance=-1)
    assert result.gap.kind == "Lipschitz"
    assert result.gap.coverage == 1.0
    assert result.gap.upper >= 4.0


def test_the_lipschitz_bound_is_the_bound_of_the_cones():
    where = SearchSpace.of(BOX)
    rng = np.random.default_rng(2)
    u, constant = rng.random((8, 2)), 3.0
    v = np.sin(u[:, 0]) + u[:, 1]
    gap = lipschitz_gap(where, u=u, v=v, constant=constant)
    grid = np.array(list(itertools.product(np.linspace(0, 1, 201), repeat=2)))
    cones = (v + constant * np.linalg.norm(grid[:, None] - u[None], axis=2)).min(axis=1)
    assert gap.upper >= cones.max() - 1e-12
    assert gap.upper <= cones.max() + 0.05


@pytest.mark.parametrize(
    ("kwargs", "error", "match"),
    [
        ({"sense": "up"}, StudyError, "sense needs 'max' or 'min', got 'up'"),
        ({"budget": 3}, StudyError, "budget=3 is below the start design of 4 runs for 2 parameters"),
        ({"response": "z"}, StudyError, r"response 'z' is not among the model's outputs \['y'\]"),
        (
            {"start": [Outcome(parameters={"a": 9.0, "b": 0.0}, status="ok", outputs={"y": 1.0}, key="r7")]},
            StudyError,
            "run r7 of start is not in the space: parameter 'a' lies between -1 and 2 m, got 9",
        ),
        (
            {"start": [Outcome(parameters={"a": 1.0}, status="ok", outputs={"y": 1.0}, key="r7")]},
            StudyError,
            r"run r7 of start is not in the space: .*missing \['b'\]",
        ),
        ({"lipschitz": -1.0}, StudyError, "lipschitz needs a constant > 0 per unit of the cube, got -1.0"),
        ({"lipschitz": float("nan")}, StudyError, "lipschitz needs a constant > 0 .*, got nan"),
        ({"budget": "10"}, StudyError, "budget needs a whole number of runs >= 0, got '10'"),
        ({"budget": 10.5}, StudyError, "budget needs a whole number of runs >= 0, got 10.5"),
        ({"budget": float("nan")}, StudyError, "budget needs a whole number of runs >= 0, got nan"),
        ({"seed": -1}, StudyError, "seed needs a whole number >= 0, got -1"),
        ({"workers": 0}, StudyError, "workers needs a whole number of runs at a time >= 1, got 0"),
        ({"workers": -1}, StudyError, "workers needs a whole number of runs at a time >= 1, got -1"),
        ({"tolerance": float("nan")}, StudyError, "tolerance needs a number, .* got nan"),
        ({"enclosure": bowl}, StudyError, "enclosure needs an Enclosure, got <function bowl"),
    ],
)
def test_bad_input_is_named(kwargs, error, match):
    with pytest.raises(error, match=match):
        worst_case(bowl, BOX, **{"budget": 8, **kwargs})


def test_numbers_of_numpy_are_numbers():
    found = worst_case(bowl, BOX, budget=np.int64(6), seed=np.int64(0), lipschitz=np.float64(13.0))
    assert found.evaluations <= 6


def test_several_responses_need_a_choice():
    with pytest.raises(StudyError, match=r"the model returns \['p', 'q'\]; say which with response="):
        worst_case(lambda a, b: {"p": a, "q": b}, BOX, budget=8)


def test_a_constant_response_ends_without_a_bound():
    result = worst_case(lambda a, b: 1.0, BOX, budget=12, seed=0)
    assert result.value == 1.0
    assert result.gap.to_dict()["width"] is None
    assert result.gap.sentence.startswith("No bound is known on how much worse it could be: all 12 runs gave")


def test_an_impossible_constraint_is_named():
    space = Space(BOX.parameters, constraints=("a > 5",))
    with pytest.raises(StudyError, match="no point of the space meets its constraints"):
        worst_case(bowl, space, budget=10)


@pytest.mark.parametrize("sense", ["max", "min"])
def test_the_worst_of_a_table_is_never_below_one_of_its_runs(sense):
    """A Kriging smooths a cliff away; the run at its top is in the table."""
    sign = 1.0 if sense == "max" else -1.0
    space = Space((Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)))
    u = np.random.default_rng(4).random((40, 2))
    values = sign * (u[:, 0] + 0.1 * u[:, 1])
    values[17] = sign * 50.0
    runs = [
        Outcome(parameters={"a": a, "b": b}, status="ok", outputs={"y": v}, key=f"row {k}")
        for k, ((a, b), v) in enumerate(zip(u, values, strict=True))
    ]
    found = surrogate_worst_case(space, runs, response="y", sense=sense)
    assert sign * found.value >= 50.0
    assert sign * found.gap.upper >= sign * found.value
    assert found.run_key == "row 17"
    if found.confirmed:
        assert found.value == sign * 50.0
        assert found.status is Status.KNOWN_RUN
        assert found.parameters == {"a": u[17, 0], "b": u[17, 1]}
