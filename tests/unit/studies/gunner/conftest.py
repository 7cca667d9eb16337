"""One set of kernels for all systems of the gunner: a set for each mixture of elements would take minutes."""

import pytest

from workbench.engine.tree import compiled


@pytest.fixture(autouse=True, scope="package")
def one_set_of_kernels():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiled, "MAY_BE_ABSENT", ())
        yield
