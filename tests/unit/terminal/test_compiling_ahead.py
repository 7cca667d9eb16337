"""Kernels that processes beside a campaign compile: when, what, and that none outlives the stages."""

import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import psutil
import pytest

from workbench.stages.campaign import Campaign
from workbench.study.loading import load_study
from workbench.terminal import compiling_ahead
from workbench.terminal.compiling_ahead import compile_layout, compiled_ahead, jobs_ahead

ROOT = Path(__file__).parents[3]
DEMO = ROOT / "studies" / "occupant_demo.toml"


@pytest.fixture
def cold(monkeypatch):
    """An installation on two processors that has compiled nothing."""
    monkeypatch.setattr("surrogates.compiling.are_kernels_compiled", lambda: False)
    monkeypatch.setattr("workbench.engine.sensitivity.compiled_before.an_adjoint_is_compiled", lambda: False)
    monkeypatch.setattr(compiling_ahead, "is_report_compiled", lambda: False)
    monkeypatch.setattr(compiling_ahead, "usable_processors", lambda: 2)


@pytest.fixture
def campaign(tmp_path):
    """The demo before its first run."""
    with Campaign.from_file(shutil.copy(DEMO, tmp_path)) as opened:
        yield opened


def test_a_cold_installation_compiles_what_the_study_asks_for(cold):
    study = load_study(DEMO)
    assert list(jobs_ahead(study)) == ["report", "kriging", "layout"]
    assert list(jobs_ahead(replace(study, robust_layout=None))) == ["report", "kriging"]
    assert list(jobs_ahead(replace(study, screen=None, worst_case=None))) == ["report", "layout"]


def test_nothing_is_compiled_twice(cold, monkeypatch):
    monkeypatch.setattr("surrogates.compiling.are_kernels_compiled", lambda: True)
    assert list(jobs_ahead(load_study(DEMO))) == ["report", "layout"]
    monkeypatch.setattr("workbench.engine.sensitivity.compiled_before.an_adjoint_is_compiled", lambda: True)
    monkeypatch.setattr(compiling_ahead, "is_report_compiled", lambda: True)
    assert list(jobs_ahead(load_study(DEMO))) == []


@pytest.mark.parametrize("evaluate", [{"workers": 1}, {"workers": 2, "engine": "inline"}, {}])
def test_a_study_of_one_process_stays_one(cold, evaluate):
    assert list(jobs_ahead(replace(load_study(DEMO), evaluate=evaluate))) == []


def test_there_is_no_work_beside_the_only_processor(cold, monkeypatch):
    monkeypatch.setattr(compiling_ahead, "usable_processors", lambda: 1)
    assert list(jobs_ahead(load_study(DEMO))) == []


def test_what_is_not_compiled_when_the_stages_end_is_left(cold, campaign):
    before = set(psutil.Process().children())
    with compiled_ahead(campaign):
        beside = set(psutil.Process().children()) - before
        assert {process.cmdline()[-2] for process in beside} == {"report", "kriging", "layout"}
        if sys.platform != "win32":  # priorities count within a session; Ctrl-C is for a group
            assert {os.getsid(process.pid) for process in beside} == {os.getsid(0)}
            assert os.getpgid(0) not in {os.getpgid(process.pid) for process in beside}
    assert not any(process.is_running() for process in beside)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no nice")
def test_the_report_stands_back_furthest(cold, campaign):
    before = set(psutil.Process().children())
    with compiled_ahead(campaign):
        beside = set(psutil.Process().children()) - before
        (report,) = (process for process in beside if process.cmdline()[-2] == "report")
        deadline = time.monotonic() + 60
        while report.nice() != 19 and time.monotonic() < deadline:
            time.sleep(0.1)
        assert report.nice() == 19


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no nice")
def test_a_job_stands_back_and_never_comes_forward():
    asked = (
        "import os; from workbench.terminal.compiling_ahead import _stand_back\n"
        "before = os.nice(0)\n"
        "_stand_back(before + 1); _stand_back(before); _stand_back(before + 2)\n"
        "print(os.nice(0) - before)"
    )
    done = subprocess.run([sys.executable, "-c", asked], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "2"


def test_the_processes_end_with_stages_that_fail(cold, campaign):
    before = set(psutil.Process().children())
    with pytest.raises(ValueError, match="a stage"), compiled_ahead(campaign):
        raise ValueError("a stage")
    assert set(psutil.Process().children()) <= before


def test_a_study_whose_stages_are_done_is_not_asked(cold, campaign, monkeypatch):
    monkeypatch.setattr(compiling_ahead, "settled", lambda campaign: {"report": "report.html"})
    before = set(psutil.Process().children())
    with compiled_ahead(campaign):
        assert set(psutil.Process().children()) <= before


@pytest.mark.slow
def test_bytecode_of_the_report_is_kept_by_its_job(tmp_path):
    asked = "from workbench.terminal.compiling_ahead import is_report_compiled; print(is_report_compiled())"
    job = [sys.executable, "-m", "workbench.terminal.compiling_ahead", "report", str(DEMO)]
    fresh = {**os.environ, "PYTHONPYCACHEPREFIX": str(tmp_path)}
    fresh.pop("PYTHONDONTWRITEBYTECODE", None)
    unkept = {**fresh, "PYTHONDONTWRITEBYTECODE": "1"}

    def answer(environment) -> str:
        return subprocess.run(
            [sys.executable, "-c", asked],
            env=environment,
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()

    assert answer(fresh) == "False"
    assert answer(unkept) == "True", "nothing would be kept"
    subprocess.run(job, env=fresh, cwd=ROOT, check=True)
    assert answer(fresh) == "True"


def test_numba_is_not_loaded_for_the_question(tmp_path):
    """A run whose stages are done takes a fraction of a second; numba alone takes two."""
    asked = "import sys, workbench.terminal.compiling_ahead; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", asked], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_a_model_that_may_call_another_code_is_not_run(monkeypatch):
    class Bridge:
        def problem(self, scenarios):
            raise AssertionError("a run of another code costs")

    monkeypatch.setattr("workbench.robust_layout.model.load_layout_model", lambda *a, **k: Bridge())
    study = load_study(DEMO)
    compile_layout(study, study.robust_layout)


@pytest.mark.slow
@pytest.mark.parametrize("job", ["kriging", "layout"])
def test_a_job_leaves_nothing_of_it_to_do(tmp_path, job):
    """In an empty cache the process of a job compiles what the question is asked about."""
    asked = (
        "from surrogates import are_kernels_compiled as kriging\n"
        "from workbench.engine.compiler.cache import is_kept\n"
        "from workbench.engine.elements._kernels_law_series import law_series\n"
        "from workbench.engine.sensitivity.compiled_before import an_adjoint_is_compiled\n"
        "def layout(): return an_adjoint_is_compiled() and is_kept(law_series)\n"
        f"print({job}())"
    )
    fresh = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}

    def answer() -> str:
        done = subprocess.run(
            [sys.executable, "-c", asked], env=fresh, cwd=ROOT, capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    assert answer() == "False"
    subprocess.run(
        [sys.executable, "-m", "workbench.terminal.compiling_ahead", job, str(DEMO)],
        env=fresh, cwd=ROOT, check=True,
    )  # fmt: skip
    assert answer() == "True"
