"""Lists of a JSON mapping some entries at a time: any JSON, however it is written and wherever it is cut."""

import io
import json

import numpy as np
import pytest

from workbench.system import json_pieces
from workbench.system.json_pieces import list_in_pieces, without_lists

MAPPINGS = {
    "numbers": [[k * 0.1, -1e-300, k] for k in range(200)],
    "texts": [f"r{k:04d}" for k in range(300)],
    "words": [["a],[b", 'say "]', 1.5, None], ["\\", "]]", "[[", True]] * 20,
    "brackets": ["]", '"]', "a", ",", '",', "\\"] * 15,
    "deep": [[[1], [2]], [[3]], [], [[]]] * 10,
    "uneven": [[1, [2], 3], [4, [5, [6]], 7]] * 10,
    "plain": list(range(100)),
    "records": [{"a": [1, 2]}, {"b": "]"}] * 10,
    "single": [[12345678901234567890]],
    "empty": [],
    "number": 123456789.25,
    "text": "end",
    "mapping": {"numbers": [[1]], "x": []},
}
WAYS = {"compact": {"separators": (",", ":")}, "lines": {"indent": 1}, "usual": {}}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("window", [1, 7, 64, 1 << 20])
def test_whatever_is_left_out_or_taken_alone_is_what_json_says(window, way, monkeypatch):
    monkeypatch.setattr(json_pieces, "WINDOW", window)
    rng = np.random.default_rng(window)
    for _ in range(6):
        names = list(MAPPINGS)
        order = [names[k] for k in rng.permutation(len(names))]
        text = json.dumps({name: MAPPINGS[name] for name in order}, **WAYS[way])
        left_out = {name for name in names if rng.random() < 0.5}
        found = without_lists(io.StringIO(text), left_out)
        assert found == {name: MAPPINGS[name] for name in names if name not in left_out}
    for name, value in MAPPINGS.items():
        if isinstance(value, list):
            pieces = list_in_pieces(io.StringIO(text), name)
            assert [entry for piece in pieces for entry in piece] == value


def test_only_a_part_is_held(monkeypatch):
    monkeypatch.setattr(json_pieces, "WINDOW", 1000)
    text = json.dumps({"a": [[0.5, 0.25]] * 5000, "keys": ["k" * 32] * 5000}, separators=(",", ":"))
    for name, length in (("a", 5000), ("keys", 5000)):
        sizes = [len(piece) for piece in list_in_pieces(io.StringIO(text), name)]
        assert sum(sizes) == length
        assert max(sizes) <= 200


def test_what_is_no_mapping_or_has_no_such_list():
    assert without_lists(io.StringIO(" [1, 2] "), {"a"}) == [1, 2]
    assert list(list_in_pieces(io.StringIO("[1]"), "a")) == []
    assert list(list_in_pieces(io.StringIO('{"b": 1}'), "a")) == []
    with pytest.raises(ValueError, match=r"expecting a list at character 5, found '1'"):
        list(list_in_pieces(io.StringIO('{"a":1}'), "a"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"a" 1}', "expecting ':' at character 5, found '1'"),
        ('{"a": 1 "b": 2}', "expecting ',' or '}' at character 8, found '\"'"),
        ('{"a": 1} 2', "expecting the end at character 9, found '2'"),
        ("[1] 2", "expecting the end at character 4, found '2'"),
        ('{"a": [[1, 2], [3', "Expecting|delimiter"),
        ('{"l": [[1,2],[3', "Expecting|delimiter"),
        ('{"l": ["a","b', "Unterminated string"),
        ('{"a": 1', "expecting ',' or '}'"),
        ("", "Expecting value"),
    ],
)
def test_text_that_is_no_json(text, message):
    with pytest.raises(ValueError, match=message):
        without_lists(io.StringIO(text), {"l"})
