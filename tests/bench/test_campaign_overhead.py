"""What a campaign costs per evaluation, beside engines that keep nothing; and how a large one resumes.

Ours stores every answer durably before it is acknowledged; the peers only hand back a value.
"""

import resource
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from workbench.models.protocol import Answer
from workbench.provenance.content import ContentCache
from workbench.provenance.named import model_files
from workbench.provenance.reading import readings_now
from workbench.provenance.state import model_state
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.study.loading import load_study
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


def cpu_with_children():
    """Processor seconds of this process and of those that it waited for, such as git."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in used)


def begun_anew(study, place):
    """Processor time in s of learning the state of a study's model and the code of its readers."""
    spec, wanted = study.spec(version="1"), study.model.get("state") or {}
    cpu = cpu_with_children()
    cache = ContentCache(place)
    model_state(spec, wanted, cache=cache)
    readings_now(study.readings, spec, model_files(spec), wanted, cache=cache)
    cache.write()
    return cpu_with_children() - cpu


def finished(campaign, keys, *, knows_state):
    """Processor time in s of storing answers that belong to a state of the model, or to none."""
    campaign.store.state_now = 1 if knows_state else None
    cpu = time.process_time()
    with campaign.store.transaction():
        for key in keys:
            campaign.store.finish(key, Answer(status="ok", outputs={"y": 1.0}), attempt=1)
    return time.process_time() - cpu


def spread(values, *, digits=1):
    """The median, and the quarter of the values below and above it."""
    low, middle, high = np.quantile(values, [0.25, 0.5, 0.75])
    return f"{middle:.{digits}f} (half of them {low:.{digits}f} to {high:.{digits}f})"


def test_what_the_state_of_a_model_costs(tmp_path):
    """With a state and without take turns, so that whatever else the machine does meets both."""
    print()
    for name in ("occupant_braking.toml", "adams_loop/loop.toml", "buck_converter/buck.toml"):
        study = load_study(Path(__file__).parents[2] / "studies" / name)
        first, *others = (1000 * begun_anew(study, tmp_path / f"{study.name}.json") for _ in range(21))
        print(f"state of the model of {name}, the first time   {first:.1f} ms")
        print(f"state of the model of {name}, from then on   {min(others):.1f} ms")
        print(f"    {spread(others)}")
    space = Space([Parameter("a", lower=0, upper=1)])
    turns, some = 60, 500
    with Campaign.of(pause, space, folder=tmp_path / "c") as campaign:
        total = 2 * turns * some
        keys = campaign.enqueue([{"a": k / total} for k in range(total)], batch="design")
        cpu = {True: [], False: []}
        for turn in range(turns):
            for k, knows in enumerate((True, False) if turn % 2 else (False, True)):
                part = keys[(2 * turn + k) * some :][:some]
                cpu[knows].append(1000 * finished(campaign, part, knows_state=knows) / some)
        begun = time.process_time()
        campaign.evaluate([{"a": 0.5 + (k + 0.5) / (3 * total)} for k in range(some)])
        whole = 1000 * (time.process_time() - begun) / some
    more = np.array(cpu[True]) - np.array(cpu[False])
    rng = np.random.default_rng(1)
    low, high = np.quantile(np.median(rng.choice(more, (2000, turns)), axis=1), [0.025, 0.975])
    for knows in (True, False):
        words = "with" if knows else "without"
        print(f"an answer stored {words} the state of the model   {np.median(cpu[knows]):.5f} ms")
    print(
        f"    the state: {1000 * np.median(more):.2f} us more, 95 % {1000 * low:.2f} to {1000 * high:.2f} us"
    )
    print(f"    in percent of {whole:.3f} ms a run of 1 ms takes here: {100 * low / whole:.2f} to "
          f"{100 * high / whole:.2f} %")  # fmt: skip


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
