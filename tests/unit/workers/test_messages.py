"""Messages between coordinator and workers carry numbers as they are."""

import io
import math

import numpy as np
import pytest

from workbench.errors import EvaluationFailed
from workbench.models.histories import History, Reduction
from workbench.models.protocol import Answer, settle
from workbench.workers.messages import answer_from_dict, answer_to_dict, opened, pack, receive


def travelled(answer):
    return answer_from_dict(receive(io.BytesIO(pack(answer_to_dict(answer)))))


def test_an_answer_comes_as_it_went():
    time = np.linspace(0, 1, 4)
    odd = np.array([-0.0, math.nan, -math.inf, 5e-324])
    answer = Answer(
        status="ok",
        outputs={"y": 0.1 + 0.2},
        gradients={"y": {"a": 1.0}},
        histories={"y": History(time, odd), "z": History(time.copy(), [1, 2, 3, 4])},
        kept={"\N{GREEK SMALL LETTER ALPHA}": 3.0},
        log="é",
    )
    back = travelled(answer)
    assert back.histories["y"].values.tobytes() == odd.tobytes()
    assert back.histories["z"] == History(time, [1.0, 2.0, 3.0, 4.0])
    assert back.histories["y"].time is back.histories["z"].time, "equal times travel once"
    assert (back.outputs, back.gradients, back.kept, back.log) == (
        answer.outputs, answer.gradients, answer.kept, answer.log,
    )  # fmt: skip


def test_histories_travel_in_eight_bytes_a_number():
    time = np.linspace(0, 1, 1000)
    answer = Answer(status="ok", histories={n: History(time, np.sin(k * time)) for k, n in enumerate("abc")})
    assert len(pack(answer_to_dict(answer))) < 4 * 8 * 1000 + 500


def test_a_message_of_plain_types_has_no_parts():
    assert opened(pack({"row": {"a": 1.5}, "workdir": None})[8:]) == {"row": {"a": 1.5}, "workdir": None}
    with pytest.raises(TypeError, match="a message holds plain types and bytes, got set"):
        pack({"a": set()})


@pytest.mark.parametrize("row", [[1, 2], (1.0, 2.0), np.array([1, 2]), iter([1, 2]), ["1", "2"]])
def test_any_row_of_numbers_is_a_history(row):
    found = settle({"y": ([0, 1], row)}, {"y": Reduction(kind="max")}).histories["y"]
    assert found == History([0.0, 1.0], [1.0, 2.0])
    assert not found.values.flags.writeable


@pytest.mark.parametrize("row", [[1, None], [[1, 2], [3, 4]], [1j, 2], "ab", 3.0])
def test_what_is_no_row_of_numbers_is_none(row):
    with pytest.raises(EvaluationFailed, match=r"a pair \(time, values\) is needed"):
        settle({"y": ([0, 1], row)}, {"y": Reduction(kind="max")})
