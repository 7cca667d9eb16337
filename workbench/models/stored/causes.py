"""Why a run failed, in a line: of a command in its solver's own words; and what several causes share.

The folder of a run is no part of its cause: it carries the run's key, and no two causes would be alike.
"""

import re

from workbench.models.command import ENDED_BADLY

__all__ = ["KEPT_IN", "cause_of", "kept_in", "shared_words", "without_numbers"]

LONGEST = 200  # characters of a cause
KEPT_IN = " (kept in "  # what the failure of a command ends with
OTHERWISE = "…"  # stands for numbers that differ
NUMBER = re.compile(
    rf"0x[0-9a-f]+|\b[0-9a-f]{{16,}}\b|(?<![A-Za-z])[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?|{OTHERWISE}",
    re.IGNORECASE,
)
COMPLAINT = re.compile(
    r"\b(?:\w*error|\w*exception|fatal|fail|failed|failure|cannot|can't|can not|could not|unable to|"
    r"abort(?:ed|ing)?|diverge[sd]?|divergence|singular|no(?:t)? converge\w*|no convergence|panic|"
    r"segmentation fault|illegal|invalid|no such file|not found|denied)\b",
    re.IGNORECASE,
)


def cause_of(error: str, log: str) -> str:
    """Why a run failed, in a line: of a command the last line of its log that speaks of an error.

    Where none does and the command ended with an exit code, it is the last line of all.

    >>> log = "step 1\\n*** ERROR: no convergence\\nbye"
    >>> cause_of("solver ended with exit code 3 (kept in work/3fa9)", log)
    'solver ended with exit code 3: *** ERROR: no convergence'
    >>> cause_of("solver ended with exit code 3 (kept in work/3fa9)", "step 1\\nlicence is used up")
    'solver ended with exit code 3: licence is used up'
    >>> cause_of("ValueError: negative load", "Traceback ...")
    'ValueError: negative load'
    """
    first = next((line.strip() for line in error.splitlines() if line.strip()), "no message")
    plain, kept, _ = first.partition(KEPT_IN)
    lines = [line.strip() for line in log.splitlines() if line.strip()] if kept else []
    telling = [line for line in lines if COMPLAINT.search(line)]
    if not telling and ENDED_BADLY in plain:
        telling = lines
    text = f"{plain}: {telling[-1]}" if telling else plain
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def kept_in(error: str) -> str:
    """The folder in which a failed run was kept; "" without one.

    >>> kept_in("solver ended with exit code 3 (kept in work/3fa9)")
    'work/3fa9'
    """
    return error.partition(KEPT_IN)[2].split("\n")[0].removesuffix(")")


def without_numbers(cause: str) -> str:
    """What causes that differ in their numbers alone have in common.

    >>> without_numbers("no root below 3.5e-2")
    'no root below #'
    """
    return NUMBER.sub("#", cause)


def shared_words(cause: str, other: str) -> str:
    """One cause for two that differ in their numbers alone: numbers that differ become an ellipsis.

    >>> shared_words("ERROR 4711: no convergence in step 515", "ERROR 4711: no convergence in step 9")
    'ERROR 4711: no convergence in step …'
    """
    if cause == other:
        return cause
    theirs = iter(NUMBER.findall(other))
    return NUMBER.sub(lambda mine: mine[0] if next(theirs, None) == mine[0] else OTHERWISE, cause)
