"""JSON of large designs: written in pieces, read without the long lists that nobody wants."""

import json
import re

import pytest

from workbench.errors import StoreError
from workbench.system import atomic
from workbench.system.atomic import read_json_without, write_json

DOCUMENT = {
    "unit": [[0.5, -1e-300], [0.25, 1.0]],
    "name": "a \"design\" ]] of 'ß' \\ , }",
    "run_keys": ["ab", "cd"],
    "words": [["x]]", 1.0], ['"]', 2.0]],
    "escaped": ['"]', "\\"],
    "empty": [],
    "none": None,
    "n": 2,
    "inner": {"unit": [[1.0]], "run_keys": ["kept"]},
}
LISTS = ("unit", "run_keys", "words", "escaped", "empty", "absent")


@pytest.mark.parametrize("data", [DOCUMENT, {}])
def test_a_document_in_pieces_is_the_same(tmp_path, monkeypatch, data):
    monkeypatch.setattr(atomic, "PIECE", 1)
    write_json(tmp_path / "d.json", data, compact=True)
    whole = json.dumps(data, sort_keys=True, ensure_ascii=False, separators=(",", ":"))
    assert (tmp_path / "d.json").read_text() == whole + "\n"


@pytest.mark.parametrize("indent", [None, 1])
def test_lists_are_left_out_and_the_rest_is_read(tmp_path, indent):
    path = tmp_path / "d.json"
    path.write_text(" " + json.dumps(DOCUMENT, indent=indent) + "\n")
    wanted = {name: value for name, value in DOCUMENT.items() if name not in LISTS}
    assert read_json_without(path, LISTS, above=0) == wanted
    assert read_json_without(path, (), above=0) == DOCUMENT
    assert read_json_without(path, LISTS, above=10**6) == DOCUMENT, "it is small"
    assert read_json_without(tmp_path / "absent.json", LISTS, above=0) is None


@pytest.mark.parametrize(
    "text", ['{"a" 1}', '{"a": 1 "b": 2}', '{"a": 1} 2', '{"unit": [[1, 2', '{"a": 1', "[1"]
)
def test_what_is_no_document_is_refused(tmp_path, text):
    path = tmp_path / "d.json"
    path.write_text(text)
    with pytest.raises(StoreError, match=f"cannot read {re.escape(str(path))}: .* to have it made anew"):
        read_json_without(path, ("unit",), above=0)


def test_a_list_is_read_as_a_list(tmp_path):
    (tmp_path / "d.json").write_text("[1, 2]")
    assert read_json_without(tmp_path / "d.json", ("unit",), above=0) == [1, 2]
