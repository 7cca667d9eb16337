"""holdfast's own processes take one thread; a program of the user's is started with what the user has."""

import os

import pytest

from workbench.system.processes.own_threads import environment_of_the_user, limit_own_threads


@pytest.fixture
def bare(monkeypatch):
    """An environment that says nothing of threads."""
    kept = {name: value for name, value in os.environ.items() if not name.endswith("_THREADS")}
    monkeypatch.setattr(os, "environ", kept)


def test_what_is_set_for_holdfast_does_not_reach_a_program(bare):
    before = dict(os.environ)
    limit_own_threads()
    assert os.environ["OMP_NUM_THREADS"] == os.environ["MKL_NUM_THREADS"] == "1"
    assert environment_of_the_user() == before
    limit_own_threads()  # a holdfast that holdfast starts knows what was set
    assert environment_of_the_user() == before


def test_what_the_user_has_set_stays_and_reaches_a_program(bare):
    os.environ["OMP_NUM_THREADS"] = "8"
    limit_own_threads()
    assert os.environ["OMP_NUM_THREADS"] == "8"
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"
    assert environment_of_the_user()["OMP_NUM_THREADS"] == "8"
    assert "OPENBLAS_NUM_THREADS" not in environment_of_the_user()
