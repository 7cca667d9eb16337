"""`--history FILE`: what the benchmarks print is appended to a file, so that commits can be compared."""

import builtins
import os
from pathlib import Path

import pytest

from tests.bench.history import append, commit_of, timed_row

WHOLE = "whole test, processor time with children"


def pytest_addoption(parser):
    parser.addoption("--history", type=Path, help="append every printed time to this CSV file")


@pytest.fixture(autouse=True)
def _history(request, monkeypatch):
    """Rows of one test: each time that it prints, and the processor time it took in all."""
    file = request.config.getoption("--history")
    if file is None:
        yield
        return
    rows = []
    show = print

    def kept(*words, **how):
        rows.extend(filter(None, map(timed_row, " ".join(map(str, words)).splitlines())))
        show(*words, **how)

    monkeypatch.setattr(builtins, "print", kept)
    begin = sum(os.times()[:4])
    yield
    rows.append((WHOLE, sum(os.times()[:4]) - begin))
    test = request.node.nodeid.removeprefix("tests/bench/")
    append(file, commit_of(request.config.rootpath), [(test, *row) for row in rows])
