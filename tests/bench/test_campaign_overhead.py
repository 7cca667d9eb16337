"""What a campaign costs per evaluation, beside engines that keep nothing; and how a large one resumes.

Ours stores every answer durably before it is acknowledged; the peers only hand back a value.
"""

import time
from concurrent.futures import ProcessPoolExecutor

import pytest

from workbench.models.protocol import Answer
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.system.atomic import write_json

pytestmark = pytest.mark.bench

N = 1000
PAUSE = 0.001  # s, the work of one evaluation
STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "a"
lower = 0
upper = 1
[[response]]
name = "y"
[evaluate]
engine = "{engine}"
workers = {workers}
"""
CODE = f"import time\ndef f(a):\n    time.sleep({PAUSE})\n    return a\n"


def pause(a):
    time.sleep(PAUSE)
    return a


def per_task(begun, workers):
    """Wall time per evaluation beyond the work itself, in ms."""
    return 1000 * ((time.perf_counter() - begun) / N - PAUSE / workers)


def ours(folder, engine, workers):
    folder.mkdir()
    (folder / "m.py").write_text(CODE)
    (folder / "s.toml").write_text(STUDY.format(engine=engine, workers=workers))
    with Campaign.from_file(folder / "s.toml") as campaign:
        campaign.evaluate([{"a": 1.0}])  # workers are up
        begun, cpu = time.perf_counter(), time.process_time()
        campaign.evaluate([{"a": k / (2 * N)} for k in range(N)])
        return per_task(begun, workers), 1000 * (time.process_time() - cpu) / N


def test_overhead_per_evaluation(tmp_path):
    rows = []
    for engine, workers in (("inline", 1), ("processes", 1), ("processes", 2)):
        wall, cpu = ours(tmp_path / f"{engine}{workers}", engine, workers)
        rows.append((f"holdfast {engine}, {workers} worker(s), durable", wall, cpu))
    with ProcessPoolExecutor(2) as pool:
        list(pool.map(pause, [0.0, 0.1]))
        begun, cpu = time.perf_counter(), time.process_time()
        for future in [pool.submit(pause, k / N) for k in range(N)]:
            future.result()
        wall = per_task(begun, 2)
        rows.append(("concurrent.futures, 2 workers", wall, 1000 * (time.process_time() - cpu) / N))
    try:
        import joblib
    except ImportError:
        pass
    else:
        with joblib.Parallel(n_jobs=2, batch_size=1) as parallel:
            parallel(joblib.delayed(pause)(0.1) for _ in range(4))
            begun, cpu = time.perf_counter(), time.process_time()
            parallel(joblib.delayed(pause)(k / N) for k in range(N))
            wall = per_task(begun, 2)
            rows.append(("joblib loky, 2 workers", wall, 1000 * (time.process_time() - cpu) / N))
    try:
        from distributed import Client, as_completed
    except ImportError:
        pass
    else:
        with Client(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True) as client:
            client.gather(client.map(pause, [0.0, 0.1], pure=False))
            begun, cpu = time.perf_counter(), time.process_time()
            for _ in as_completed([client.submit(pause, k / N, pure=False) for k in range(N)]):
                pass
            wall = per_task(begun, 2)
            rows.append(("dask.distributed, 2 workers", wall, 1000 * (time.process_time() - cpu) / N))
    print(f"\n{'1000 evaluations of 1 ms':<45} {'overhead ms':>12} {'coordinator CPU ms':>19}")
    for name, wall, cpu in rows:
        print(f"{name:<45} {wall:>12.2f} {cpu:>19.2f}")


def test_a_campaign_of_1e5_evaluations_resumes(tmp_path):
    count = 100_000
    space = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
    rows = [{"a": k / count, "b": (7 * k % count) / count} for k in range(count)]

    def model(a, b):
        raise AssertionError("every run is known")

    with Campaign.of(model, space, folder=tmp_path / "c") as campaign:
        keys = campaign.enqueue(rows, batch="design")
        with campaign.store.transaction():
            for key, row in zip(keys, rows, strict=True):
                campaign.store.finish(key, Answer(status="ok", outputs={"y": row["a"]}), attempt=1)
        document = {
            "space_hash": space.hash,
            "physical": [list(row.values()) for row in rows],
            "run_keys": keys,
        }
        write_json(campaign.folder / "design.json", document)
    begun, cpu = time.perf_counter(), time.process_time()
    with Campaign.of(model, space, folder=tmp_path / "c") as campaign:
        opened = time.process_time() - cpu
        assert evaluate(campaign)["counts"] == {"ok": count}
        resumed, wall = time.process_time() - cpu, time.perf_counter() - begun
        cpu = time.process_time()
        data = campaign.results()
        exported = time.process_time() - cpu
    assert float(data["y"][5]) == 5 / count
    print(
        f"\n1e5 evaluations: opened in {opened:.2f} s, all known again in {resumed:.2f} s of processor time"
    )
    print(f"({wall:.2f} s on the clock), as a Dataset in {exported:.2f} s")
