"""A made-up campaign's folder for tests of the report: real runs of Welch's function, invented judgements.

The documents have the shape that the stages write; the numbers in `screening.json` are not a screening's.
"""

import json
import math
from pathlib import Path

import numpy as np

from studies.welch20 import NAMES, welch20, worst_corner
from tests.sample_motion import sample_motion
from workbench.campaign.store_schema import SCHEMA
from workbench.search.evidence.gap import Gap
from workbench.system.database import connected

RUNS = 40
PATH = ((None, -52.3), ("x12", -44.1), ("x4", -40.7), ("x20", -31.2), ("x19", -20.0), ("x16", -18.5))
SELECTED = ["x12", "x4", "x20", "x19"]
THRESHOLD = 1.92


def write_sample(folder: Path, *, q2: float = 0.91, confirmed: bool = True, failures: int = 3) -> Path:
    """Write the folder; `failures` runs of the design get another status than ok."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(20)
    unit = rng.random((RUNS, 20))
    rows = [dict(zip(NAMES, (u - 0.5).tolist(), strict=True)) for u in unit]
    values = [welch20(**row) for row in rows]
    status = ["ok"] * RUNS
    for k in range(failures):
        status[7 * k + 1] = ("failed", "timeout", "nonfinite")[k % 3]
    history = _history(rows, values, status, rng)
    _database(folder / "runs.sqlite", rows, values, status, history)
    ok = [k for k in range(RUNS) if status[k] == "ok"]
    parameters = [{"name": n, "unit": "1", "kind": "continuous", "lower": -0.5, "upper": 0.5} for n in NAMES]
    _write(
        folder / "design.json",
        {
            "algorithm": "ihs", "options": {"duplication": 5}, "seed": 1, "n": RUNS, "d": 20,
            "parameters": parameters, "space": {"parameters": parameters}, "unit": unit.tolist(),
            "physical": (unit - 0.5).tolist(),
            "run_ids": [f"r{k + 1:04d}" for k in range(RUNS)], "run_keys": [_key(k) for k in range(RUNS)],
            "quality": {
                "min_distance": {"value": 1.11, "percentile": 93.0, "better": "high"},
                "cd2": {"value": 14.2, "percentile": 31.0, "better": "low"},
                "max_correlation": {"value": 0.41, "percentile": 66.0, "better": "low"},
            },
            "versions": {"holdfast": "0.1.0"}, "space_hash": "5e" * 16,
        },
    )  # fmt: skip
    _write(
        folder / "screening.json",
        _screening(np.array([values[k] for k in ok]), [_key(k) for k in ok], q2, rng),
    )
    _write(folder / "worst_case.json", _worst(history, confirmed))
    _write(
        folder / "study.lock.json",
        {
            "resolved": {"study": {"name": "sample", "seed": 1}, "parameter": parameters,
                         "response": [{"name": "y", "unit": "kN"}]},
            "study_hash": "ab" * 16, "space_hash": "5e" * 16, "seed": 1,
            "model": {"identity": "python studies.welch20:welch20", "version": "1", "source": "c0ffee"},
            "versions": {"python": "3.11.7", "holdfast": "0.1.0", "numpy": "2.4.6"},
        },
    )  # fmt: skip
    return folder


def _key(k: int) -> str:
    return f"{k:04x}" * 8


def _write(path: Path, document: object) -> None:
    path.write_text(json.dumps(document, indent=1))


def _history(rows, values, status, rng):
    history = [
        {"run_key": _key(k), "iteration": 0, "proposal": "given", "status": status[k],
         "value": values[k] if status[k] == "ok" else None, "predicted": None, "predicted_std": None,
         "parameters": rows[k]}
        for k in range(RUNS)
    ]  # fmt: skip
    corner = worst_corner()
    for i, proposal in enumerate(
        ["predicted", "corner", "ei", "trust", "predicted", "explore", "corner", "ei"]
    ):
        pull = min(0.95, 0.3 + 0.15 * i)
        row = {n: float(pull * corner[n] + (1 - pull) * rng.uniform(-0.5, 0.5)) for n in NAMES}
        if i == 6:
            row = corner
        value = welch20(**row)
        history.append(
            {"run_key": _key(RUNS + i), "iteration": i + 1, "proposal": proposal, "status": "ok",
             "value": value, "predicted": value + rng.normal() * 0.6, "predicted_std": 0.6, "parameters": row}
        )  # fmt: skip
    best = -math.inf
    for h in history:
        best = max(best, -math.inf if h["value"] is None else h["value"])
        h["best"] = best if math.isfinite(best) else None
    return history


def _database(path, rows, values, status, history):
    path.unlink(missing_ok=True)
    connection = connected(path)
    connection.executescript("BEGIN;" + SCHEMA)
    errors = {"failed": "ZeroDivisionError: division by zero", "timeout": "no result after 5 s",
              "nonfinite": "response 'y' is nan"}  # fmt: skip
    for k, h in enumerate(history):
        state = status[k] if k < RUNS else "ok"
        connection.execute(
            "INSERT INTO evaluation (key, status, attempt, batch, model, version, inputs, outputs, error, "
            "created, "
            "wall, cpu) VALUES (?, ?, 1, ?, 'python studies.welch20:welch20', '1', ?, ?, ?, 0.0, 0.01, 0.01)",
            (_key(k), state, "design" if k < RUNS else "worst_case", json.dumps(h["parameters"]),
             json.dumps({"y": h["value"]}) if state == "ok" else None, errors.get(state)),
        )  # fmt: skip
    connection.commit()
    connection.close()


def _screening(y, keys, q2, rng):
    n = len(y)
    std = np.full(n, float(np.sqrt(max(1 - q2, 1e-3)) * y.std()))
    z = rng.normal(size=n)
    selected, path, level = [], [], None
    for k, (added, likelihood) in enumerate(PATH):
        selected = [*selected, added] if added else selected
        gain = 0.0 if level is None else likelihood - level
        path.append({"step": k, "selected": selected, "added": [added] if added else [],
                     "theta_common": 0.3 * 0.3**k,
                     "theta": {}, "sigma2": 2.2 + k, "log_likelihood": likelihood, "gain": gain,
                     "accepted": k == 0 or gain >= THRESHOLD})  # fmt: skip
        level = likelihood
    x = np.linspace(-0.5, 0.5, 21)
    shapes = {"x12": 5 * np.log(3) * x, "x4": 5 * (x**2), "x20": 5 * (x**2), "x19": 40 * x**3 - 5 * x}
    theta = {name: 10.0 ** (-0.3 * k) if name in SELECTED else 1e-4 * (k + 1) for k, name in
             enumerate([*SELECTED, *[m for m in NAMES if m not in SELECTED]])}  # fmt: skip
    return {
        "response": "y", "unit": "kN", "method": "forward",
        "criterion": "restricted log-likelihood l of (3.13), constant 0, larger is better",
        "rule": f"a step is accepted when l rises by at least {THRESHOLD}",
        "n_runs": n, "n_left_out": RUNS - n, "path": path, "selected": SELECTED, "ranking": list(theta),
        "theta": theta, "verdict": "resolved: every other set is at least 4 lower in l",
        "stability": {"x12": 1.0, "x4": 0.9},
        "kriging": {"trend": "constant", "correlation": "gaussian",
                    "theta": {name: theta[name] for name in SELECTED}, "sigma2": 9.1, "nugget": 1e-9,
                    "beta": [0.9], "log_likelihood": -20.0},
        "leave_one_out": {
            "run_ids": keys, "observed": y.tolist(), "predicted": (y + z * std).tolist(), "std": std.tolist(),
            "standardised": z.tolist(), "q2": q2, "coverage95": float(np.mean(np.abs(z) <= 1.96)),
        },
        "main_effects": {
            name: dict(zip(("x", "mean", "lower", "upper"), (x.tolist(), m.tolist(), (m - 0.4).tolist(),
                                                             (m + 0.4).tolist()), strict=True))
            for name, m in shapes.items()
        },
        "sobol": {"total": {"x12": 0.66, "x4": 0.2}, "main": {"x12": 0.55, "x4": 0.03}},
        "advice": "ten more runs would settle x19", "diagnosis": {"resolved": True, "threshold": THRESHOLD},
    }  # fmt: skip


def _worst(history, confirmed):
    best = max((h for h in history if h["value"] is not None), key=lambda h: h["value"])
    x = np.linspace(-0.5, 0.5, 41)
    profile = {}
    for name in NAMES:
        line = np.array([welch20(**(best["parameters"] | {name: v})) for v in x.tolist()])
        profile[name] = {"x": x.tolist(), "mean": line.tolist(), "lower": (line - 0.5).tolist(),
                         "upper": (line + 0.5).tolist()}  # fmt: skip
    return {
        "response": "y", "unit": "kN", "sense": "max", "value": best["value"],
        "parameters": best["parameters"],
        "confirmed": confirmed, "run_key": best["run_key"] if confirmed else "",
        "label": "confirmed by a true run" if confirmed else "surrogate only, unconfirmed",
        "predicted": best["predicted"], "predicted_std": best["predicted_std"],
        "status": "the budget was spent",
        "evaluations": len(history) - RUNS, "budget": 8, "seed": 1, "failures": {},
        "history": history if confirmed else history[:RUNS],
        "gap": Gap(upper=best["value"] + 0.2, width=0.2, coverage=0.95, kind="model-based").to_dict(),
        "audit": {"corners": None, "corners_run": 1, "corners_open": None, "is_corner": True,
                  "sentences": ["1 corner was run; there are too many to run them all"],
                  "monotone": {"x12": "rising", "x4": "mixed"}, "monotone_share": {"x12": 1.0, "x4": 0.4}},
        "baselines": {
            name: {"runs": n, "value": history[0]["value"], "run_key": history[0]["run_key"]}
            for name, n in {"the runs given": RUNS, "random corners": 12}.items()
        },
        "profile": profile,
    }  # fmt: skip


def write_loop(folder: Path) -> None:
    """Add a layout, a re-evaluation and a motion to a sample."""
    rng = np.random.default_rng(9)
    members = [
        {"name": f"{kind[0].upper()}{k}", "kind": kind, "density": density, "a": [0.1, 0.9 + 0.1 * k],
         "b": [1.2 * (-1) ** k, 1.3 - 0.35 * k]}
        for k, (kind, density) in enumerate(
            [("belt", 1.0), ("airbag", 0.8), ("retractor", 0.6), ("belt", 0.3), ("belt", 0.01)]
        )
    ]  # fmt: skip
    tried = [4 + 8 * 0.8**k + 0.3 * (k % 3) for k in range(20)]
    history = [{"evaluation": k + 1, "value": v, "best": min(tried[: k + 1])} for k, v in enumerate(tried)]
    _write(
        folder / "layout.json",
        {
            "response": "y", "unit": "kN", "value": history[-1]["best"], "history": history,
            "members": members,
            "baselines": {"uniform": 7.9, "nominal-only": 6.2}, "status": "Converged.",
            "outlines": [[[-0.1, 0.6], [0.2, 0.6], [0.25, 1.3], [-0.05, 1.3]]],
            "shadow_prices": {"belts": 0.12, "airbags": 0.0}, "gradient_check": {"discrete adjoint": 3e-9},
            "scenarios": [{"name": "worst case 1", "value": 4.1, "parameters": {"x12": 0.5}}],
        },
    )  # fmt: skip
    old, new = rng.gamma(9, 1, 200), rng.gamma(6, 0.7, 200)
    values = {"before": old.tolist(), "after": [None, *new.tolist()[1:]]}

    def summary(name, y, failed):
        triple = {f"P{q:g}": [float(np.percentile(y, q)), float(np.percentile(y, max(q - 4, 0))),
                              float(np.percentile(y, min(q + 4, 100)))] for q in (5, 50, 95)}  # fmt: skip
        return {
            "design": name, "n": len(y), "failed": failed, "mean": float(y.mean()),
            "mean_interval": [0.0, 1.0],
            "quantiles": triple, "worst": float(y.max()), "worst_scenario": {"x12": 0.5},
            "beyond_limit": [float((y > 12).mean()), 0.0, 0.1], "largest_regret": 1.0, "mean_regret": 0.2,
            "nominal": float(y[3]), "price_of_robustness": 0.3, "failed_share": [failed / 200, 0.0, 0.03],
            "beyond_or_failed": [float((y > 12).mean()) + failed / 200, 0.0, 0.1],
        }  # fmt: skip

    _write(
        folder / "robust.json",
        {
            "designs": ["before", "after"], "sense": "max", "unit": "kN", "limit": 12.0, "samples": 200,
            "drawn": 200, "left_out": 1, "nominal": {"x12": 0.25},
            "inadmissible": {"before": 0, "after": 7},
            "warnings": ["after gave no value in 1 of 200 scenarios, and fails where before is bad"],
            "scenarios": [{} for _ in range(200)], "values": values,
            "paired": {"after - before": [float((new - old).mean()), -6.0, -4.0]},
            "summaries": [summary("before", old, 0), summary("after", new[1:], 1)],
        },
    )  # fmt: skip
    _write(folder / "motion.json", sample_motion().to_dict())
