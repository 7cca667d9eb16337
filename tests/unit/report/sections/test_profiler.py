"""The profiler of the report: packed arrays, a numpy twin of the script, and the script in a browser."""

import base64
import json
import re

import numpy as np
import pytest

from surrogates.analysis.response_map import response_map
from tests.browser import needs_browser, visit
from tests.plain_kriging import plain
from tests.sample_campaign import write_sample
from workbench import Campaign, Parameter
from workbench.report.page.html import PAGE
from workbench.report.sections.profiler import label_codes, map_numbers, posterior_arrays
from workbench.report.writing import write_report
from workbench.stages.design import evaluate
from workbench.stages.run_all import run_stage

POINTS = 100
# the page and Python sum the same numbers in another order
AGREEMENT = 1e-9
NUGGET_LEAVES = 1e-3

CASES = [
    ("gaussian", "constant", 0.0),
    ("gaussian", "quadratic", 1e-3),
    ("matern52", "linear", 1e-6),
    ("matern32", "interactions", 0.0),
    ("matern72", "constant", 1e-3),
    ("power_exponential", "constant", 1e-6),
]
WORDS = (1,)  # columns that hold the codes of words
WITH_WORDS = [("gaussian", "constant", 1e-3), ("matern52", "linear", 1e-6)]


def with_words(correlation, trend, nugget):
    """A Kriging of which one input takes four words, one of them in none of its runs."""
    rng = np.random.default_rng(5)
    x = rng.random((40, 3))
    x[:, 1] = rng.integers(3, size=40)
    y = np.sin(4 * x[:, 0]) + np.array([0.3, -1.0, 2.0])[x[:, 1].astype(int)] * x[:, 2] + 250.0
    kriging = plain(
        correlation=correlation, trend=trend, nugget=nugget, theta=[3.0, 0.7, 0.4], categorical=WORDS
    )
    kriging.fit(x, y)
    points = rng.random((POINTS, 3))
    points[:, 1] = rng.integers(-1, 3, size=POINTS)
    return kriging, points


def fitted(correlation, trend, nugget):
    rng = np.random.default_rng(3)
    x = rng.random((40, 3))
    y = np.sin(4 * x[:, 0]) + x[:, 1] ** 2 * x[:, 2] + 250.0
    kriging = plain(correlation=correlation, trend=trend, nugget=nugget, theta=[3.0, 1.0, 0.4], eta=1.7)
    kriging.fit(x, y)
    kriging.posterior_ = kriging.posterior_.calibrated(1.3, nugget=kriging.nugget_)
    return kriging, rng.random((POINTS, 3))


def floats(text):
    return np.frombuffer(base64.b64decode(text), dtype="<f8")


def twin(data, points):
    """profiler.js in numpy."""
    n, d, p = data["n"], data["d"], data["p"]
    x = (points - floats(data["low"])) / floats(data["width"]) - 0.5
    h = np.abs(x[:, None, :] - floats(data["u"]).reshape(n, d)[None])
    t = floats(data["theta"])
    a3, a5, a7 = np.sqrt(3 * t) * h, np.sqrt(5 * t) * h, np.sqrt(7 * t) * h
    one = {
        "gaussian": np.exp(-t * h**2),
        "power_exponential": np.exp(-t * h ** data["eta"]),
        "matern32": (1 + a3) * np.exp(-a3),
        "matern52": (1 + a5 + a5**2 / 3) * np.exp(-a5),
        "matern72": (1 + a7 + 2 * a7**2 / 5 + a7**3 / 15) * np.exp(-a7),
    }[data["kind"]]
    for k in data["labels"]:
        one[:, :, k] = np.where(h[:, :, k] > 0, np.exp(-t[k]), 1.0)
    r = one.prod(axis=2)
    f = np.column_stack([np.prod(x[:, term], axis=1) for term in data["terms"]])
    mean = f @ floats(data["coefficients"]) + r @ floats(data["weights"])
    lower = np.zeros((n, n))
    lower[np.tril_indices(n)] = floats(data["lower"])
    a = np.linalg.solve(lower, r.T)
    rf = floats(data["rf"]).reshape(p, p)
    g = np.linalg.solve(rf.T, f.T) - floats(data["q"]).reshape(n, p).T @ a
    variance = np.maximum(1 - (a**2).sum(axis=0) + (g**2).sum(axis=0), 0)
    return data["shift"] + data["scale"] * mean, data["scale"] * np.sqrt(
        data["sigma2"] * (variance + data["new_run"])
    )


KRIGINGS = [*((fitted, case) for case in CASES), *((with_words, case) for case in WITH_WORDS)]


@pytest.mark.parametrize(("made", "case"), KRIGINGS)
def test_the_packed_arrays_are_the_whole_prediction(made, case):
    kriging, points = made(*case)
    mean, std = kriging.predict(points, return_std=True)
    ours = twin(json.loads(json.dumps(posterior_arrays(kriging.posterior_))), points)
    np.testing.assert_allclose(ours[0], mean, atol=AGREEMENT, rtol=0)
    np.testing.assert_allclose(ours[1], std, atol=AGREEMENT, rtol=0)


@pytest.mark.browser
@needs_browser
@pytest.mark.parametrize(("made", "case"), [*KRIGINGS[:3], *KRIGINGS[-2:]])
def test_the_script_predicts_as_python_does(made, case, tmp_path):
    kriging, points = made(*case)
    script = (PAGE / "profiler.js").read_text()
    page = tmp_path / "harness.html"
    page.write_text(
        f'<pre id="out"></pre><script type="application/json" id="profiler-data">'
        f"{json.dumps(posterior_arrays(kriging.posterior_))}</script><script>{script}</script>"
        f"<script>document.getElementById('out').textContent = JSON.stringify({json.dumps(points.tolist())}"
        ".map((p) => Object.values(holdfast.predict(p))))</script>"
    )
    seen = visit(page)
    assert seen.console == []
    got = np.array(json.loads(re.search(r'<pre id="out">(.*?)</pre>', seen.dom, re.S)[1]))
    mean, std = kriging.predict(points, return_std=True)
    np.testing.assert_allclose(got, np.column_stack([mean, std]), atol=AGREEMENT, rtol=0)


@pytest.fixture
def undrawn(monkeypatch):
    """Drawing is the slow part; tests of words and tables leave it out."""
    monkeypatch.setattr("workbench.report.page.html.draw_svg", lambda draw, **options: "<svg></svg>")


def data_of(page):
    return json.loads(re.search(r'id="profiler-data">(.*?)</script>', page, re.S)[1])


@pytest.mark.usefixtures("undrawn")
def test_the_report_carries_the_kriging_of_the_screening(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    data = data_of(write_report(folder).read_text())
    screening = json.loads((folder / "screening.json").read_text())
    names = [p["name"] for p in data["parameters"]]
    assert names == screening["selected"]
    # with a nugget of 1e-9 the prediction all but passes through the runs that were screened
    keys = json.loads((folder / "design.json").read_text())["run_keys"]
    unit = np.array(json.loads((folder / "design.json").read_text())["unit"])
    rows = [keys.index(key) for key in screening["leave_one_out"]["run_ids"]]
    columns = [int(name[1:]) - 1 for name in names]
    mean, _ = twin(data, unit[np.ix_(rows, columns)])
    np.testing.assert_allclose(mean, screening["leave_one_out"]["observed"], atol=NUGGET_LEAVES)
    assert [preset["label"] for preset in data["presets"]] == ["worst case", "middle of all ranges"]
    assert data["presets"][0]["point"] == [1.0, 1.0, 0.0, 1.0]


@pytest.mark.usefixtures("undrawn")
def test_the_bands_are_those_of_a_new_run_where_they_are_calibrated(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    plain = data_of(write_report(folder).read_text())
    assert plain["new_run"] == 0.0
    screening = json.loads((folder / "screening.json").read_text())
    screening["kriging"] |= {"calibration": "cross_validation", "interval_factor": 1.5}
    (folder / "screening.json").write_text(json.dumps(screening))
    scaled = data_of(write_report(folder).read_text())
    assert scaled["sigma2"] == pytest.approx(1.5**2 * plain["sigma2"])
    assert scaled["new_run"] == screening["kriging"]["nugget"]


STUDY = """
[study]
name = "s"
seed = 1
[model]
kind = "python"
function = "grip.py:f"
[[parameter]]
name = "hands"
kind = "categorical"
levels = ["none", "one", "both"]
[[parameter]]
name = "load"
lower = 1
upper = 3
[[response]]
name = "y"
[design]
runs = 24
[evaluate]
engine = "inline"
[screen]
response = "y"
"""
MODEL = """
def f(hands, load):
    return {"none": 0.0, "one": 5.0, "both": 1.0}[hands] + load ** 2
"""


@pytest.mark.usefixtures("undrawn")
def test_words_are_chosen_among_and_predicted_by_their_own(tmp_path):
    (tmp_path / "grip.py").write_text(MODEL)
    (tmp_path / "s.toml").write_text(STUDY)
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
        run_stage(campaign, "screen")
    data = data_of(write_report(campaign.folder).read_text())
    (at,) = data["labels"]
    words = data["parameters"][at]
    assert (words["name"], words["levels"], words["codes"]) == ("hands", ["none", "one", "both"], [0, 1, 2])
    points = np.full((3, 2), 0.5)
    points[:, at] = words["codes"]
    mean, std = twin(data, points)
    np.testing.assert_allclose(mean, [4.0, 9.0, 5.0], atol=0.1)  # load = 2
    assert (std < 0.5).all()


def test_a_word_that_was_not_run_is_like_no_other():
    hands = Parameter("hands", kind="categorical", levels=["none", "one", "both"])
    assert label_codes(hands, np.array([1.0, 0.0, 1.0])) == [0, -1, 1]


@pytest.mark.usefixtures("undrawn")
def test_no_profiler_without_the_runs(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    (folder / "runs.sqlite").unlink()
    page = write_report(folder).read_text()
    assert "profiler-data" not in page
    assert "script-src &#39;none&#39;" in page


def carried(numbers, w):
    """`carriedBack` of profiler.js in numpy."""
    if numbers["scale"] == "none":
        return w
    power = numbers["power"]
    held = np.clip(w, numbers["low"], numbers["high"])

    def box_cox(v, power):
        return np.exp(v) if abs(power) < 1e-8 else np.exp(np.log1p(power * v) / power)

    if numbers["scale"] == "yeo-johnson":
        up, down = np.maximum(held, 0), np.maximum(-held, 0)
        back = np.where(held >= 0, box_cox(up, power) - 1, 1 - box_cox(down, 2 - power))
    else:
        back = box_cox(held, power)
    return numbers["centre"] + numbers["unit"] * back


SCALES = ("none", "log", "box-cox", "yeo-johnson")


@pytest.mark.parametrize("scale", SCALES)
def test_the_map_goes_back_as_python_does(scale):
    y = np.exp(np.random.default_rng(0).normal(size=40) * 2.0)
    mapped = response_map(y, scale)
    w = np.linspace(-9.0, 9.0, 41) * np.abs(mapped.forward(y)).max() / 6.0
    np.testing.assert_allclose(carried(map_numbers(mapped), w), mapped.inverse(w), rtol=AGREEMENT)


@pytest.mark.browser
@needs_browser
@pytest.mark.parametrize("scale", SCALES)
def test_the_script_carries_back_as_python_does(scale, tmp_path):
    kriging, _ = fitted("gaussian", "constant", 1e-3)
    mapped = response_map(np.exp(np.random.default_rng(0).normal(size=40) * 2.0), scale)
    data = posterior_arrays(kriging.posterior_) | {"map": map_numbers(mapped)}
    means = [[m, 0.3] for m in np.linspace(-3.0, 3.0, 21)]
    page = tmp_path / "harness.html"
    page.write_text(
        f'<pre id="out"></pre><script type="application/json" id="profiler-data">{json.dumps(data)}</script>'
        f"<script>{(PAGE / 'profiler.js').read_text()}</script>"
        f"<script>document.getElementById('out').textContent = JSON.stringify({json.dumps(means)}"
        ".map(([mean, sd]) => Object.values(holdfast.carry({ mean, sd }))))</script>"
    )
    got = np.array(json.loads(re.search(r'<pre id="out">(.*?)</pre>', visit(page).dom, re.S)[1]))
    w = np.array(means)[:, :1] + 0.3 * 1.959963984540054 * np.array([[0.0, -1.0, 1.0]])
    np.testing.assert_allclose(got, mapped.inverse(w), rtol=AGREEMENT)


@pytest.mark.usefixtures("undrawn")
def test_a_screening_on_another_scale_brings_the_map_of_its_kriging(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    screening = json.loads((folder / "screening.json").read_text())
    screening["kriging"] |= {"scale": "yeo-johnson", "scale_in_words": "yeo-johnson (power 0.9)"}
    (folder / "screening.json").write_text(json.dumps(screening))
    page = write_report(folder).read_text()
    data = data_of(page)
    assert "of the response on the scale yeo-johnson (power" in page
    assert "the median is shown, carried back" in page
    assert "on the scale yeo-johnson (power 0.9), carried back to its unit" in page
    keys = json.loads((folder / "design.json").read_text())["run_keys"]
    unit = np.array(json.loads((folder / "design.json").read_text())["unit"])
    rows = [keys.index(key) for key in screening["leave_one_out"]["run_ids"]]
    columns = [int(p["name"][1:]) - 1 for p in data["parameters"]]
    mean, _ = twin(data, unit[np.ix_(rows, columns)])
    observed = screening["leave_one_out"]["observed"]
    np.testing.assert_allclose(carried(data["map"], mean), observed, atol=NUGGET_LEAVES)
