"""The choice among the laws that a table lists."""

import numpy as np
from numba import njit

from workbench.engine import Belt, Contact, Spring
from workbench.engine.compiler.held import listed
from workbench.engine.compiler.options import ENTRY
from workbench.engine.elements._kernels_laws import held_laws, laws
from workbench.engine.elements.table import PARAMETERS


@njit(**{**ENTRY, "cache": False})
def both(held, code, p, delta, rate, some, every):
    held_laws(held, code, p, 0, delta.shape[0], delta, rate, 0.0, some[0], some[1], some[2])
    laws(code, p, 0, delta.shape[0], delta, rate, 0.0, every[0], every[1], every[2])


def test_listed_laws_are_those_of_the_whole_table_and_others_do_nothing():
    delta, rate = np.linspace(-0.02, 0.03, 11), np.linspace(1.0, -1.0, 11)
    p = np.zeros((PARAMETERS, 11))
    for law, known in ((Belt(c=3.0), True), (Contact(k=200.0), True), (Spring(k=5.0), False)):
        p[: len(law.parameters)] = np.array(law.parameters)[:, None]
        some, every = np.full((3, 11), 7.0), np.zeros((3, 11))
        both(listed(["Belt", "Contact"]), law.code, p, delta, rate, some, every)
        np.testing.assert_array_equal(some, every if known else np.full((3, 11), 7.0))
