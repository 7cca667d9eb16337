"""FMUs through FMPy and runs on a Dask cluster, from a study file to results."""

import json
import subprocess
import sys
import warnings

import pytest

from workbench.errors import StudyError
from workbench.stages.campaign import Campaign
from workbench.stages.validation import check_study

pytestmark = pytest.mark.peer

UNIT = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

class Oscillator(Fmi2Slave):
    def __init__(self, **options):
        super().__init__(**options)
        self.k, self.m, self.x, self.v = 100.0, 1.0, 0.1, 0.0
        for name in ("k", "m"):
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
            )
        for name in ("x", "v"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, time, step):
        n = 50
        for _ in range(n):  # the symplectic Euler method
            self.v -= self.k / self.m * self.x * step / n
            self.x += self.v * step / n
        return True
"""
UNIT3 = """
from pythonfmu3 import Fmi3Causality, Fmi3Slave, Fmi3Variability, Float64

class Oscillator(Fmi3Slave):
    def __init__(self, **options):
        super().__init__(**options)
        self.time, self.k, self.m, self.x, self.v = 0.0, 100.0, 1.0, 0.1, 0.0
        continuous, tunable = Fmi3Variability.continuous, Fmi3Variability.tunable
        for name, causality, variability in (
            ("time", Fmi3Causality.independent, continuous),
            ("k", Fmi3Causality.parameter, tunable),
            ("m", Fmi3Causality.parameter, tunable),
            ("x", Fmi3Causality.output, continuous),
            ("v", Fmi3Causality.output, continuous),
        ):
            self.register_variable(Float64(name, causality=causality, variability=variability))

    def do_step(self, time, step):
        n = 50
        for _ in range(n):
            self.v -= self.k / self.m * self.x * step / n
            self.x += self.v * step / n
        return True
"""
STUDY = """
[study]
name = "osc"
[model]
kind = "fmu"
file = "Oscillator.fmu"
stop_time = 1.0
step = 0.01
variables = { stiffness = "k" }
outputs = { peak = "v", place = "x" }
[[parameter]]
name = "stiffness"
lower = 50
upper = 400
unit = "N/m"
[[parameter]]
name = "m"
lower = 0.5
upper = 2
unit = "kg"
[[response]]
name = "peak"
unit = "m/s"
reduce = "max_abs"
[[response]]
name = "place"
unit = "m"
[design]
kind = "sobol"
runs = 6
[evaluate]
timeout = 60.0
"""


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def unit(tmp_path_factory, request):
    fmpy = pytest.importorskip("fmpy")
    builder, code = {"2.0": ("pythonfmu", UNIT), "3.0": ("pythonfmu3", UNIT3)}[request.param]
    pytest.importorskip(builder)
    folder = tmp_path_factory.mktemp("unit")
    (folder / "oscillator.py").write_text(code)
    subprocess.run(
        [sys.executable, "-m", builder, "build", "-f", "oscillator.py"],
        cwd=folder,
        check=True,
        capture_output=True,
    )
    (path,) = folder.glob("*.fmu")
    assert fmpy.read_model_description(str(path)).fmiVersion == request.param
    return path


def study(tmp_path, unit, text=STUDY):
    (tmp_path / "Oscillator.fmu").write_bytes(unit.read_bytes())
    (tmp_path / "s.toml").write_text(text)
    return tmp_path / "s.toml"


def test_an_fmu_is_a_model(tmp_path, unit):
    path = study(tmp_path, unit)
    with Campaign.from_file(path) as campaign:
        check_study(campaign.study)
        points = [[0.1, 0.9], [0.5, 0.5], [0.9, 0.2], [0.3, 0.7]]
        rows = campaign.evaluate(campaign.study.space.rows(points))
        assert [row.status for row in rows] == ["ok"] * 4
        for row in rows:
            # x = 0.1 cos(w t): the largest speed is 0.1 w when a quarter of a period is within a second
            w = (row.inputs["stiffness"] / row.inputs["m"]) ** 0.5
            assert row.outputs["peak"] == pytest.approx(0.1 * w, rel=0.02)
        history = campaign.history(rows[0].key)
        assert history["peak"].sizes["time_peak"] == 101


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"k"', '"kk"', "FMU Oscillator.fmu has no variable 'kk'; it has "),
        ('"Oscillator.fmu"', '"gone.fmu"', "no FMU .*gone.fmu"),
        ('"Oscillator.fmu"', '"../Oscillator.fmu"', "needs to be a path inside"),
        ('"Oscillator.fmu"', '"s.toml"', "FMU s.toml cannot be unpacked"),
    ],
)
def test_fmus_that_do_not_fit(tmp_path, unit, old, new, words):
    path = study(tmp_path, unit, STUDY.replace(old, new, 1))
    with Campaign.from_file(path) as campaign, pytest.raises(StudyError, match=words):
        campaign.evaluate([{"stiffness": 100.0, "m": 1.0}])


PYTHON = """
[study]
name = "s"
seed = 4
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "a"
lower = 0
upper = 40
[[response]]
name = "y"
[evaluate]
engine = "{engine}"
workers = 2
timeout = 1.0
"""
CODE = """
import os, time
def f(a):
    n = round(a)
    if n == 5: raise ValueError("five")
    if n == 9: os._exit(3)
    if n == 14: time.sleep(60)
    return a / 3
"""


def on(engine, folder):
    folder.mkdir()
    (folder / "m.py").write_text(CODE)
    (folder / "s.toml").write_text(PYTHON.format(engine=engine))
    with Campaign.from_file(folder / "s.toml") as campaign:
        rows = campaign.evaluate([{"a": float(k)} for k in range(20)])
        return [(r.id, r.key, r.status, json.dumps(dict(r.outputs)), r.error) for r in rows]


@pytest.mark.filterwarnings("ignore")
def test_a_dask_cluster_gives_what_processes_give(tmp_path):
    pytest.importorskip("distributed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert on("dask", tmp_path / "dask") == on("processes", tmp_path / "processes")


@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_does_not_answer(tmp_path):
    pytest.importorskip("distributed")
    (tmp_path / "m.py").write_text(CODE)
    (tmp_path / "s.toml").write_text(PYTHON.format(engine="dask"))
    with Campaign.from_file(tmp_path / "s.toml", dask="tcp://127.0.0.1:1") as campaign:
        with pytest.raises(StudyError, match=r"no Dask scheduler answers at tcp://127.0.0.1:1"):
            campaign.evaluate([{"a": 1.0}])


def test_without_dask_the_engine_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    (tmp_path / "m.py").write_text(CODE)
    (tmp_path / "s.toml").write_text(PYTHON.format(engine="dask"))
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        with pytest.raises(StudyError, match=r"engine 'dask' needs Dask: pip install 'holdfast\[dask\]'"):
            campaign.evaluate([{"a": 1.0}])
