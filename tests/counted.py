"""Values of a parametrised test that `make counts` alone runs: the same once more, many times over."""

from collections.abc import Iterable
from typing import Any

import pytest


def counted(values: Iterable[Any]) -> list[Any]:
    """These values with the mark `count`, beside others that `make slow` runs too."""
    return [pytest.param(value, marks=pytest.mark.count) for value in values]
