"""What time histories cost: three of 10 000 samples a run, from the worker into the file, and one instant."""

import time

import numpy as np
import pytest

from workbench.histories.store import HistoryStore
from workbench.models.histories import History
from workbench.models.protocol import settle
from workbench.workers.messages import answer_from_dict, answer_to_dict, opened, pack

pytestmark = pytest.mark.bench

RUNS = 500
T = np.linspace(0, 1, 10_000)


def returned(k):
    """What a model returns: smooth signals over the same times."""
    a, b = 1 + k / RUNS, 2 - (7 * k % RUNS) / RUNS
    decay = (T, a * np.exp(-3 * T) * np.sin(40 * b * T))
    sum_of_three = (T, np.sin(6 * a * T) + np.sin(18 * T + 0.4) / 3 + np.sin(44 * b * T) / 7)
    return {"x": decay, "v": sum_of_three, "f": (T, 1e3 * b * np.cos(12 * a * T) * T)}


def test_three_histories_of_ten_thousand_samples(tmp_path):
    spent = 0.0
    with HistoryStore.opened(tmp_path) as store:
        for k in range(RUNS):
            raw = returned(k)
            cpu = time.process_time()
            answer = settle({"y": 1.0, **raw}, {"y": None}, keep=tuple(raw))
            back = answer_from_dict(opened(pack({"answer": answer_to_dict(answer)})[8:])["answer"])
            store.write([(f"{k:032x}", {name: (h, "1") for name, h in back.histories.items()})])
            spent += time.process_time() - cpu
    size = sum(path.stat().st_size for path in tmp_path.iterdir())
    with HistoryStore.reading(tmp_path) as store:
        cpu = time.process_time()
        entries = store.entries(name="f")
        instant = store.values(entries, 5_000, 5_001)
        looked = time.process_time() - cpu
        assert store.history(entries[3]) == History(T, returned(3)["f"][1])
    assert instant[3, 0] == returned(3)["f"][1][5_000]
    assert size / RUNS < 0.15e6
    print(f"\nthree histories of 10 000 samples, answered, carried and stored   {1e3 * spent / RUNS:.2f} ms")
    print(f"their size, all bits kept   {size / RUNS / 1e6:.3f} MB")
    print(f"one instant of 10 000 runs   {looked / RUNS * 1e4:.2f} s")
