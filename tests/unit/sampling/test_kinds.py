"""The table of design kinds: every entry makes a design of a small space by a function that is there."""

from dataclasses import fields

import numpy as np
import pytest
from scipy.stats import qmc

import doe
from workbench.errors import StudyError
from workbench.sampling.kinds import KINDS, DesignOptions
from workbench.sampling.plan import make_design
from workbench.space.box import Parameter, Space

SPACE = Space([Parameter(name, lower=1.0, upper=3.0) for name in "abc"])
NEEDED = {"grid": DesignOptions(levels=3)}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_makes_a_design(kind):
    entry = KINDS[kind]
    home = qmc if entry.way == "sequence" else doe
    assert callable(getattr(home, entry.function))
    assert set(entry.options) <= {field.name for field in fields(DesignOptions)}
    runs = 8 if entry.needs_runs else None
    design = make_design(SPACE, kind, runs, seed=1, options=NEEDED.get(kind))
    assert design.unit.shape[1] == 3
    assert len(design) == (runs or len(design)) > 3
    assert len(np.unique(design.unit, axis=0)) > 3
    again = make_design(SPACE, kind, runs, seed=1, options=NEEDED.get(kind))
    np.testing.assert_array_equal(design.unit, again.unit)


@pytest.mark.parametrize("kind", [name for name, entry in KINDS.items() if entry.needs_runs])
def test_kinds_that_need_their_number_of_runs(kind):
    with pytest.raises(StudyError, match=f"design kind '{kind}' needs runs >= 1, got None"):
        make_design(SPACE, kind, None)
