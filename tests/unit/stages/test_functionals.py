"""Screening and worst case of numbers read off histories: maximum, value at a time, principal components."""

import json

import numpy as np
import pytest

from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.functionals import functional_of
from workbench.models.histories import Reduction
from workbench.report.writing import write_report
from workbench.stages.campaign import Campaign
from workbench.stages.other_screenings import other_screening
from workbench.stages.run_all import run_stage
from workbench.study.loading import parse_study

STUDY = """
[study]
name = "s"
seed = 3
[model]
kind = "python"
function = "m.py:f"
keep = ["speed"]
[[parameter]]
name = "size"
lower = 1
upper = 2
[[parameter]]
name = "rate"
lower = -1
upper = 1
[[parameter]]
name = "idle"
lower = 0
upper = 1
[[response]]
name = "force"
unit = "kN"
reduce = "max"
[design]
runs = 24
[evaluate]
engine = "inline"
"""
CODE = """
import numpy as np
def f(size, rate, idle):
    t = np.linspace(0, 1, 400) ** 2
    force = size * np.sin(np.pi * t) + 0.2 * rate * np.sin(2 * np.pi * t)
    return {"force": (t, force), "speed": (t, (2 - size) * t + rate * t * (1 - t))}
"""
SCREEN = '[screen]\nresponse = "{}"\n'
ROBUST = '[robust]\nresponse = "max of force"\n[[robust.design]]\nname = "a"\nvalues = { size = 1.5 }\n'
WORST = '[worst_case]\nresponse = "{}"\nsense = "{}"\nbudget = 10\n'


@pytest.mark.parametrize(
    ("name", "history", "reduction", "mode"),
    [
        ("max of force", "force", Reduction(kind="max"), 0),
        ("max_abs_of_a_of_b", "a_of_b", Reduction(kind="max_abs"), 0),
        ("force_at_m0p25", "force", Reduction(kind="at", at=-0.25), 0),
        ("force at 3", "force", Reduction(kind="at", at=3.0), 0),
        ("norm of force", "force", Reduction(kind="norm"), 0),
        ("force at 2e-3", "force", Reduction(kind="at", at=0.002), 0),
        ("force at 0.5", "force", Reduction(kind="at", at=0.5), 0),
        ("pc12 of force", "force", None, 12),
    ],
)
def test_names_say_what_is_read(name, history, reduction, mode):
    found = functional_of(name)
    assert (found.history, found.reduction, found.mode) == (history, reduction, mode)
    assert found.name.isidentifier()
    assert functional_of(found.name) == found


@pytest.mark.parametrize(
    "name", ["force", "pc0 of force", "force at noon", "at of force", "most of force", "max of a b", ""]
)
def test_other_names_say_nothing(name):
    assert functional_of(name) is None


def test_a_study_knows_what_it_keeps():
    study = parse_study(STUDY + SCREEN.format("pc1 of speed") + WORST.format("force at 0.5", "min"))
    assert study.functional_names == ("pc1 of speed", "force at 0.5")
    assert study.target("force at 0.5").name == "force_at_0p5"
    assert (study.target("force at 0.5").unit, study.target("pc1 of speed").unit) == ("kN", "1")
    with pytest.raises(StudyError, match="reads the time history 'travel', which runs do not keep; kept are"):
        parse_study(STUDY + SCREEN.format("max of travel"))
    with pytest.raises(StudyError, match="no response 'most of force'; the responses are force"):
        parse_study(STUDY + WORST.format("most of force", "max"))
    with pytest.raises(StudyError, match="no response 'max of force'; the responses are force"):
        parse_study(STUDY + ROBUST)
    plain = STUDY.replace('reduce = "max"\n', "").replace('keep = ["speed"]\n', "")
    with pytest.raises(StudyError, match="kept are: none; a response with `reduce` is one"):
        parse_study(plain + SCREEN.format("max of force"))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A campaign whose design has run, in a folder that studies are written into."""
    folder = tmp_path_factory.mktemp("functionals")
    (folder / "m.py").write_text(CODE)
    opened(folder, "").close()
    return folder


def opened(folder, tables):
    (folder / "s.toml").write_text(STUDY + tables)
    campaign = Campaign.from_file(folder / "s.toml")
    run_stage(campaign, "design")
    document = json.loads((campaign.folder / "design.json").read_text())
    names = campaign.study.space.names
    campaign.evaluate([dict(zip(names, row, strict=True)) for row in document["physical"]])
    return campaign


def components(values, times):
    """Modes and shares by the eigenvectors of the covariance over time, not by singular values."""
    weights = np.gradient(times)
    weights[[0, -1]] /= 2
    weights /= weights.sum()
    root = np.sqrt(np.maximum(weights, 1e-300))
    covariance = np.cov(values.T) * root[:, None] * root
    sizes, vectors = np.linalg.eigh(covariance)
    shapes = vectors[:, ::-1].T / root
    shapes *= np.sign(shapes[np.arange(len(shapes)), np.abs(shapes).argmax(axis=1)])[:, None]
    return shapes, sizes[::-1] / sizes.sum(), weights, values.mean(axis=0)


@pytest.mark.parametrize(
    ("name", "selected"),
    [
        ("pc1 of force", "size"),
        pytest.param("pc2 of force", "rate", marks=pytest.mark.slow),
        ("speed at 1.0", "size"),
    ],
)
def test_a_functional_is_screened(made, name, selected):
    with opened(made, SCREEN.format(name)) as campaign:
        document = run_stage(campaign, "screen")
        data = campaign.histories("force")
    assert document["response"] == functional_of(name).name
    assert document["ranking"][0] == selected
    if name.startswith("pc"):
        _, shares, _, _ = components(data["force"].values, data["time"].values)
        (mode,) = document["modes"]
        assert mode["share"] == pytest.approx(shares[int(name[2]) - 1], rel=1e-6)
        assert mode["runs"] == 24
        assert "over 24 runs of the design, which holds" in mode["sentence"]
        page = write_report(made / "s.holdfast").read_text()
        assert f"{document['response']} is the score of principal component {name[2]} over 24 runs" in page


def test_the_worst_case_of_a_component_stands_up_to_true_runs(made):
    with opened(made, WORST.format("pc1 of force", "max")) as campaign:
        design = campaign.histories("force")
        design = design["force"].isel(run=slice(24))
        document = run_stage(campaign, "worst_case")
        shapes, shares, weights, mean = components(design.values, design["time"].values)
        corners = [{"size": a, "rate": b, "idle": c} for a in (1, 1.5, 2) for b in (-1, 0, 1) for c in (0, 1)]
        rows = campaign.evaluate(corners, batch="attack")
        data = campaign.histories("force")["force"].sel(run=[row.key for row in rows]).values
    scores = ((data - mean) * weights) @ shapes[0]
    assert document["value"] == pytest.approx(scores.max(), rel=1e-6)
    assert document["parameters"]["size"] == 2
    assert document["modes"][0]["share"] == pytest.approx(shares[0], rel=1e-6)
    assert document["unit"] == "kN"


def test_the_worst_of_a_history_that_is_kept_beside_responses(made):
    with opened(made, WORST.format("min of speed", "min")) as campaign:
        document = run_stage(campaign, "worst_case")
        assert document["value"] == pytest.approx(min_of_speed(2, -1), abs=1e-3)
        assert document["parameters"] == {"size": 2.0, "rate": -1.0} | {
            "idle": document["parameters"]["idle"]
        }
        other = other_screening(campaign, "src", response="max of speed")
        assert other["ranking"][0] == "size"


def min_of_speed(size, rate):
    t = np.linspace(0, 1, 2001)
    return float(((2 - size) * t + rate * t * (1 - t)).min())


def test_what_cannot_be_read_is_said(made):
    with opened(made, SCREEN.format("pc3 of force")) as campaign:
        with pytest.raises(
            NotEnoughRuns, match="'pc3_of_force': the 24 runs of the design differ in 2 modes"
        ):
            run_stage(campaign, "screen")
    with opened(made, SCREEN.format("force at 1.5")) as campaign:
        with pytest.raises(NotEnoughRuns, match="0 of 24 runs gave a value, 3 are needed"):
            run_stage(campaign, "screen")
    (made / "s.holdfast" / "histories.sqlite").rename(made / "away.sqlite")
    try:
        with opened(made, SCREEN.format("mean of force")) as campaign:
            with pytest.raises(
                StudyError, match=r"needs the time history 'force', which \d+ of \d+ runs have not"
            ):
                run_stage(campaign, "screen")
    finally:
        (made / "s.holdfast" / "histories.sqlite").unlink(missing_ok=True)
        (made / "away.sqlite").rename(made / "s.holdfast" / "histories.sqlite")
