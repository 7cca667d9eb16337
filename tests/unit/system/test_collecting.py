"""The collector of cycles rests inside, and is as before behind, whatever happens there."""

import gc

import pytest

from workbench.system.collecting import without_collecting


def test_it_is_as_before_after_an_error_and_where_it_rested_already():
    assert gc.isenabled()
    with pytest.raises(KeyError), without_collecting():
        {}["nothing"]
    assert gc.isenabled()
    with without_collecting():
        with without_collecting():
            pass
        assert not gc.isenabled()
