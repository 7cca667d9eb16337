"""The table of model kinds: every class it names is there, and a kind is imported when it is opened."""

import subprocess
import sys
from dataclasses import replace
from importlib import import_module

import pytest

from workbench.errors import StudyError
from workbench.models.opening import KINDS, open_model
from workbench.models.protocol import ModelSpec

SPEC = ModelSpec(
    kind="python",
    options={"function": "math:hypot"},
    folder=".",
    names=("a", "b"),
    responses={"y": None},
    identity="{}",
    version="1",
)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_names_a_class_that_opens_a_description(kind):
    module, _, name = KINDS[kind].partition(":")
    assert callable(getattr(import_module(module), name).opened)


def test_a_kind_that_is_not_there():
    with pytest.raises(
        StudyError, match=r"'ask' cannot be run here; it is one of python, command, fmu, table$"
    ):
        open_model(replace(SPEC, kind="ask"))


def test_a_worker_loads_its_own_kind_only():
    code = (
        "import sys, workbench.models.opening as o\n"
        "loaded = [m for m in (k.partition(':')[0] for k in o.KINDS.values()) if m in sys.modules]\n"
        "assert loaded == [], loaded\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
