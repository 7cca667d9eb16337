"""What a newcomer gives in the place of something else is refused by its name, before anything is run."""

from pathlib import Path

import pytest

from workbench import (
    Parameter,
    Space,
    make_design,
    minimax,
    screen,
    weighted,
    within,
    worst_case,
    worst_cases,
)
from workbench.errors import StudyError

A = Parameter("a", lower=0, upper=1)
SPACE = Space([A])
OTHER = Space([Parameter("u", lower=0, upper=1)])


def model(a):
    return a


MISTAKES = {
    "words as one text": (
        lambda: Parameter("a", kind="categorical", levels="xyz"),
        "parameter 'a' needs a list of levels, got the text 'xyz'",
    ),
    "a parameter in place of a list": (lambda: Space(A), "a space needs a list of parameters, such as"),
    "bounds by name": (lambda: Space({"a": (0, 1)}), r"got a dict \{'a': \(0, 1\)\}"),
    "names": (lambda: Space([A, "b"]), "got a str 'b' in place 1"),
    "one condition as a text": (
        lambda: Space([A], constraints="a < 0.5"),
        r"constraints needs a list of conditions, got the text 'a < 0\.5'; put it in brackets",
    ),
    "a list in place of a space": (
        lambda: worst_case(model, [A], budget=9),
        "space needs a Space of parameters",
    ),
    "a value in place of a function": (
        lambda: worst_case(3, SPACE, budget=9),
        "function needs a function that takes the parameters by name, got 3",
    ),
    "space before function": (lambda: worst_case(SPACE, model, budget=9), "function needs a function"),
    "names of responses": (
        lambda: worst_cases(model, SPACE, ["y"], budget=9),
        r"responses needs a mapping of names to 'max' or 'min', such as \{'y': 'max'\}, got \['y'\]",
    ),
    "a list of designs": (lambda: minimax(model, [A], OTHER, budget=30), "design_space needs a Space"),
    "a list of uncertain": (lambda: minimax(model, SPACE, [A], budget=30), "uncertainty needs a Space"),
    "no function of two": (
        lambda: minimax(None, SPACE, OTHER, budget=30),
        "function needs a function that takes two mappings, design and uncertainty, got None",
    ),
    "runs as a text": (lambda: make_design(SPACE, runs="50"), "needs a whole number of runs, got '50'"),
    "a design of a list": (lambda: make_design([A], runs=5), "space needs a Space of parameters"),
    "the name of a file": (
        lambda: screen(Path("runs.csv"), SPACE, "y"),
        "rows needs runs as mappings, or a table, got the name 'runs.csv'; read the file first",
    ),
    "a screening of a list": (lambda: screen([], [A], "y"), "space needs a Space of parameters"),
    "a weight as a text": (lambda: weighted({"y": "1"}), "the weight of 'y' needs a number, got '1'"),
    "one limit": (lambda: within("y", {"z": 1}), r"limits of 'z' need a pair, such as \(None, 5\.0\), got 1"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_it_is_refused_by_its_name(name):
    mistaken, said = MISTAKES[name]
    with pytest.raises(StudyError, match=said):
        mistaken()
