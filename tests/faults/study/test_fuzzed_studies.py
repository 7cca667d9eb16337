"""Malformed study files end in our error with file and line or key, never in a traceback, and soon."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from workbench.errors import StudyError
from workbench.study.loading import parse_study

GOOD = """\
constraint = ["a + b < 5", "road != 'ditch'"]
[study]
name = "fuzzed"
seed = 3
title = "A study"
[model]
kind = "command"
command = ["{python}", "{study}/solve.py", "{a}"]
templates = [{ from = "deck.tmpl", to = "deck.txt", style = "dakota" }]
files = ["lib.dat"]
environment = { THREADS = "1" }
[[parameter]]
name = "a"
lower = 0.5
upper = 2
unit = "N/m"
scale = "log"
[[parameter]]
name = "b"
baseline = 12738.9
factor = [0.5, 2.0]
[[parameter]]
name = "n"
kind = "integer"
lower = 1
upper = 9
[[parameter]]
name = "s"
kind = "discrete"
levels = [1, 2.5, 10]
[[parameter]]
name = "road"
kind = "categorical"
levels = ["flat", "ditch"]
[[parameter]]
name = "m"
distribution = { name = "norm", loc = 80, scale = 10 }
[[parameter]]
name = "g"
lower = 350
upper = 700
step = 7
[[response]]
name = "y"
unit = "mm"
reduce = "norm"
p = 4
read = { kind = "request", file = "out.req", request = "R", column = "FM" }
[[response]]
name = "z"
read = { kind = "regex", file = "out.txt", pattern = "z = (.*)" }
[design]
kind = "ihs"
runs = 20
duplication = 5
[evaluate]
workers = 2
timeout = 3.5
memory = "1.5 GB"
[screen]
response = "y"
[worst_case]
response = "z"
sense = "min"
budget = 30
tolerance = 0.01
"""
pytestmark = pytest.mark.timeout(150)  # s for hundreds of texts: none of them keeps the reader for long

LINES = GOOD.splitlines()
PIECES = [
    *'=[]{}",.#\n\0\ufeff',
    "'",
    "é",
    "nan",
    "inf",
    "-1",
    "1e999",
    "true",
    "[]",
    "{}",
    '""',
    "0x1F",
    "1979-05-27",
]
PIECES += ["name", "kind", "lower", "9" * 400, "[" * 60, '"' * 3, "\\u0000"]


@st.composite
def mutated(draw):
    """The good file with one to six lines or characters changed."""
    lines = list(LINES)
    for _ in range(draw(st.integers(1, 6))):
        k = draw(st.integers(0, len(lines) - 1))
        change = draw(st.sampled_from(["drop", "double", "swap", "value", "splice", "cut", "key"]))
        if change == "drop":
            del lines[k]
        elif change == "double":
            lines.insert(k, lines[k])
        elif change == "swap":
            j = draw(st.integers(0, len(lines) - 1))
            lines[k], lines[j] = lines[j], lines[k]
        elif change == "value" and "=" in lines[k]:
            other = draw(st.sampled_from(LINES))
            lines[k] = lines[k].split("=")[0] + "=" + other.split("=")[-1]
        elif change == "key" and "=" in lines[k]:
            other = draw(st.sampled_from(LINES))
            lines[k] = other.split("=")[0] + "=" + lines[k].split("=", 1)[1]
        elif change == "cut":
            lines[k] = lines[k][: draw(st.integers(0, 40))]
        else:
            at = draw(st.integers(0, 40))
            lines[k] = lines[k][:at] + draw(st.sampled_from(PIECES)) + lines[k][at:]
        if not lines:
            lines = [""]
    return "\n".join(lines)


def refused_or_read(text):
    said = ""
    try:
        study = parse_study(text)
    except StudyError as exc:
        said = str(exc)
    else:
        study.spec(version="1")
        study.space.rows([[0.25] * study.space.dimension])
        assert len(study.space.hash) == 32
    assert said == "" or said.startswith("study")  # the file, then the line or what is wrong with all of it


def test_the_file_that_is_mutated_is_good():
    assert parse_study(GOOD).space.dimension == 7


@settings(max_examples=500, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(mutated())
def test_mutated_files(text):
    refused_or_read(text)


@settings(max_examples=100, deadline=None)
@given(st.text(max_size=300) | st.binary(max_size=300).map(lambda b: b.decode("latin1")))
def test_any_text(text):
    refused_or_read(text)


@pytest.mark.slow
@pytest.mark.count
@pytest.mark.timeout(1200)
@settings(max_examples=10_000, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(mutated())
def test_ten_thousand_mutated_files(text):
    refused_or_read(text)
