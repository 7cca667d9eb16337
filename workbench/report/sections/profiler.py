"""The prediction profiler: the Kriging of the screening, packed so that `profiler.js` can evaluate it.

The Kriging is set up again from what `screening.json` says (theta, nugget, trend, correlation) on the runs
that were screened, without estimating anything, its intervals are scaled as they were there, and its
posterior is exported as arrays:

    mean = shift + scale (f'b + r'v)        sd = scale sqrt(sigma^2 (1 - a'a + h'h + new_run))
    a = L^-1 r    h = rf^-T f - q'a         L packed by rows, F'C^-1 F = rf'rf

A Kriging of a mapped response (see `surrogates.analysis.response_map`) brings its map: what is shown is the
median and the band carried back, value = T^-1(mean), ends = T^-1(mean -+ 1.96 sd).

A word has a code in place of a coordinate, and r = exp(-theta) between different ones.

All arrays are base64 of little-endian float64, so the page computes with the same bits as Python.
"""

import html
import json
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.report.page.blocks import (
    Html,
    Note,
    Section,
    quantity,
)
from workbench.report.page.folder import CampaignFolder

if TYPE_CHECKING:
    from workbench.space.parameter import Parameter

__all__ = ["label_codes", "map_numbers", "posterior_arrays", "profiler_section"]

TRENDS = ("constant", "linear", "interactions", "quadratic")


def profiler_section(folder: CampaignFolder) -> Section | None:
    """None without a screening whose Kriging can be set up again."""
    screening = folder["screening"]
    if screening is None or not screening.get("kriging") or not screening.get("leave_one_out"):
        return None
    title = "Try other values"
    theta = screening["kriging"]["theta"]
    names = [n for n in screening["ranking"] if n in theta]
    if screening["kriging"].get("trend") not in TRENDS:
        note = Note(text="No profiler for a trend of one's own.")
        return Section(id="profiler", title=title, blocks=(note,))
    kriging = _kriging(folder, screening, names)
    if kriging is None:
        return None
    packed = posterior_arrays(kriging.posterior)
    mapped = _map(screening)
    packed |= {
        "map": map_numbers(mapped),
        "response": screening["response"],
        "unit": str(screening.get("unit") or "1"),
        "parameters": [
            _parameter(folder.parameters[name], kriging.codes.get(k)) for k, name in enumerate(names)
        ],
        "presets": _presets(folder, names),
    }
    return Section(
        id="profiler",
        title=title,
        sentences=(
            "Move a slider to see what the Kriging of the screening predicts there. Lines are sections "
            "through the present values, bands hold the response with 95 % by the Kriging. Nothing here is "
            "a true run.",
            *_scale_said(mapped),
            *_truth(folder),
        ),
        blocks=(Html(id="profiler", markup=_markup(packed), text="The profiler stands in `report.html`."),),
    )


def _truth(folder: CampaignFolder) -> list[str]:
    """What a run at the worst case really gave, beside what this Kriging says there."""
    worst = folder["worst_case"]
    if worst is None or not worst["confirmed"]:
        return []
    found = quantity(worst["value"], str(worst.get("unit") or "1"))
    return [
        "This Kriging knows the screening's runs only, not those of the search: at the worst case the true "
        f"run gave {found}, whatever is predicted there."
    ]


def _map(screening: Mapping[str, Any]) -> Any:
    from surrogates.analysis.response_map import response_map

    observed = np.asarray(screening["leave_one_out"]["observed"], dtype=float)
    return response_map(observed, screening["kriging"].get("scale") or "none")


def map_numbers(mapped: Any) -> dict[str, Any]:
    """A `ResponseMap` as the script takes it, with the ends of w between which it goes back."""
    if mapped.scale == "none":
        return {"scale": "none"}
    low, high = mapped.forward(np.array(mapped.ends))
    return {
        "scale": mapped.scale,
        "power": 0.0 if mapped.scale == "log" else mapped.power,
        "centre": mapped.centre,
        "unit": mapped.unit,
        "low": float(low),
        "high": float(high),
    }


def _scale_said(mapped: Any) -> list[str]:
    if mapped.scale == "none":
        return []
    return [
        f"The Kriging is one of the response on the scale {mapped.words}: the median is shown, carried back."
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kriging:
    """A posterior, and of each column of words what its levels are to it: the codes 0, 1, ... of those that
    were run, -1 of the others (the correlation asks only whether two are the same)."""

    posterior: Any
    codes: Mapping[int, list[int]]


def _kriging(folder: CampaignFolder, screening: Mapping[str, Any], names: list[str]) -> _Kriging | None:
    """The Kriging of the document, None when its runs are not in the folder."""
    from surrogates import Kriging
    from workbench.space.box import Space

    loo, said = screening["leave_one_out"], screening["kriging"]
    design = folder["design"] or {}
    keys = [str(key) for key in loo.get("run_ids") or []]
    runs = folder.runs.named(keys)
    if "space" not in design or not keys or any(key not in runs for key in keys):
        return None
    space = Space.from_dict(design["space"])
    columns = [space.names.index(name) for name in names]
    x = space.unit([{n: runs[key].inputs[n] for n in space.names} for key in keys])[:, columns]
    words = [k for k, name in enumerate(names) if space.parameters[columns[k]].kind == "categorical"]
    fitted = Kriging(
        categorical=words or None,
        trend=said["trend"],
        correlation=said["correlation"],
        eta=float(said.get("eta") or 2.0),
        theta=[said["theta"][name] for name in names],
        nugget=float(said["nugget"]),
        intervals="plug-in",
    ).fit(x, _map(screening).forward(np.asarray(loo["observed"], dtype=float)))
    posterior = fitted.posterior_
    if said.get("calibration", "none") != "none":
        posterior = posterior.calibrated(float(said["interval_factor"]), nugget=fitted.nugget_)
    codes = {k: label_codes(space.parameters[columns[k]], x[:, k]) for k in words}
    return _Kriging(posterior=posterior, codes=codes)


def label_codes(parameter: "Parameter", run: np.ndarray) -> list[int]:
    """Which number the Kriging gives to each level: those of the runs (n,) count from 0 in their order."""
    seen = np.unique(run).tolist()
    levels = parameter.unit_levels
    assert levels is not None
    return [seen.index(u) if u in seen else -1 for u in levels.tolist()]


def posterior_arrays(posterior: Any) -> dict[str, Any]:
    """A posterior of `surrogates` with polynomial trend as plain types."""
    n, d = posterior.u.shape
    rows, columns = np.tril_indices(n)
    return {
        "n": n,
        "d": d,
        "p": posterior.f.shape[1],
        "kind": posterior.correlation.kind,
        "labels": list(map(int, posterior.correlation.labels)),
        "eta": float(posterior.correlation.eta),
        "terms": [list(map(int, term)) for term in posterior.trend.terms],
        "sigma2": float(posterior.sigma2),
        "shift": float(posterior.shift),
        "scale": float(posterior.scale),
        "new_run": float(posterior.new_run),
        "u": _packed(posterior.u),
        "theta": _packed(posterior.theta),
        "low": _packed(posterior.scaling.low),
        "width": _packed(posterior.scaling.width),
        "weights": _packed(posterior.weights),
        "coefficients": _packed(posterior.coefficients),
        "lower": _packed(posterior.factor.lower[rows, columns]),
        "q": _packed(posterior.factor.q),
        "rf": _packed(posterior.factor.rf),
    }


def _packed(array: Any) -> str:
    return b64encode(np.ascontiguousarray(array, dtype="<f8").tobytes()).decode()


def _parameter(p: Mapping[str, Any], codes: list[int] | None) -> dict[str, Any]:
    levels = list(p.get("levels") or [])
    if not levels and p.get("kind") == "integer":
        levels = list(range(round(p["lower"]), round(p["upper"]) + 1))
    elif not levels and p.get("step"):
        count = round((p["upper"] - p["lower"]) / p["step"]) + 1
        levels = [p["lower"] + k * p["step"] for k in range(count)]
    elif not levels and p.get("kind") == "binary":
        levels = [0, 1]
    return {
        "name": p["name"],
        "unit": str(p.get("unit") or "1"),
        "lower": p.get("lower"),
        "upper": p.get("upper"),
        "scale": p.get("scale") or "linear",
        "levels": levels,
        "codes": codes,
    }


def _presets(folder: CampaignFolder, names: list[str]) -> list[dict[str, Any]]:
    from workbench.space.box import Space

    presets = [{"label": "middle of all ranges", "point": [0.5] * len(names)}]
    worst = folder["worst_case"]
    if worst is not None and all(name in worst["parameters"] for name in names):
        space = Space.from_dict((folder["design"] or {})["space"])
        points = space.unit([{n: worst["parameters"][n] for n in space.names}])[0]
        at = [float(points[space.names.index(name)]) for name in names]
        presets.insert(0, {"label": "worst case", "point": at})
    return presets


def _markup(data: Mapping[str, Any]) -> str:
    # "<" cannot end the script element when it is written as an escape, which JSON reads back
    content = json.dumps(data, sort_keys=True, allow_nan=False).replace("<", "\\u003c")
    response = html.escape(str(data["response"]))
    return (
        '<div id="profiler-panel" class="screen-only">\n'
        '<p class="profiler-answer" role="status" aria-live="polite">'
        f"Prediction of {response}: needs JavaScript.</p>\n"
        '<div class="profiler-buttons"></div>\n<div class="profiler-grid"></div>\n</div>\n'
        f'<script type="application/json" id="profiler-data">{content}</script>'
    )
