"""One thread for the linear algebra of holdfast's own processes, and none of that for the programs of users.

Matrices of a few hundred rows cost more by threads than they gain, and workers have the other cores. What is
set for that in the environment is inherited by every program that is started, and a solver of sixteen threads
would run with one, without a word.
"""

import os

__all__ = ["environment_of_the_user", "limit_own_threads"]

NAMES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
SET_HERE = "HOLDFAST_SET_THREADS"  # which of them the user had not set


def limit_own_threads() -> None:
    """One thread, where the user has not said how many; before numpy is imported."""
    names = [name for name in NAMES if name not in os.environ]
    if names:
        os.environ |= {**dict.fromkeys(names, "1"), SET_HERE: " ".join(names)}


def environment_of_the_user() -> dict[str, str]:
    """The variables without those that were set here, for a program of the user's."""
    own = {SET_HERE, *os.environ.get(SET_HERE, "").split()}
    return {name: value for name, value in os.environ.items() if name not in own}
