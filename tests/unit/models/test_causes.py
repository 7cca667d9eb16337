"""Why a run failed, in the words of its solver, and which causes are one."""

import pytest

from workbench.models.stored.causes import cause_of, kept_in, shared_words, without_numbers

ENDED = "solver ended with exit code 3 (kept in work/3fa9)"


@pytest.mark.parametrize(
    ("error", "log", "cause"),
    [
        (ENDED, "FATAL: no licence\ntime 0.1\n", "solver ended with exit code 3: FATAL: no licence"),
        (ENDED, "ERROR 1\nERROR 2\nbye", "solver ended with exit code 3: ERROR 2"),
        (ENDED, "", "solver ended with exit code 3"),
        ("solver took longer than 5 s (kept in work/3fa9)", "step 1\nstep 2", "solver took longer than 5 s"),
        ("\n  ValueError: x\nmore", "ERROR: of another's log", "ValueError: x"),
        ("", "", "no message"),
    ],
)
def test_a_cause_is_the_last_line_that_complains_and_never_the_folder(error, log, cause):
    assert cause_of(error, log) == cause


def test_a_long_cause_is_cut_and_says_so():
    cause = cause_of(ENDED, "ERROR " + "x" * 500)
    assert len(cause) == 200
    assert cause.endswith("...")


def test_the_folder_is_told_apart():
    assert kept_in(f"{ENDED}\nmore") == "work/3fa9"
    assert kept_in("ValueError: x") == ""


def test_causes_that_differ_in_numbers_alone_are_one_and_show_only_the_numbers_that_they_share():
    first, second, third = (f"ERROR 4711: step {k} of 1e-{k}" for k in (515, 80, 9))
    assert without_numbers(first) == without_numbers(second) == "ERROR #: step # of #"
    assert shared_words(shared_words(first, second), third) == "ERROR 4711: step … of …"
    assert shared_words(first, first) == first
    assert without_numbers("mesh2 is bad") == "mesh2 is bad"  # a name, not a number
