"""Which parameters matter: the path of the screening, the correlation parameters, Sobol' shares."""

from collections.abc import Mapping
from typing import Any

from workbench.figures.screening import plot_likelihood_path, plot_theta, plot_waterfall
from workbench.report.lines.statements import minor_text, regime_text, screening_state, sentence
from workbench.report.page.blocks import (
    Block,
    Column,
    Figure,
    Level,
    Note,
    Panel,
    Section,
    Table,
    names_of,
    number,
    typeset,
)
from workbench.report.page.folder import CampaignFolder
from workbench.space.units import counted

__all__ = ["screening_section"]

LEVELS: dict[str, Level] = {"resolved": "good", "partly resolved": "fair", "not resolved": "poor"}
MOST_BARS = 14  # a longer path is drawn as a line


def _which(screening: Mapping[str, Any], selected: list[str], total: int) -> str:
    """Which parameters matter, in words that say no more than the state does."""
    response, known = screening["response"], screening_state(screening) != "not resolved"
    if not selected and not known:
        return f"None of {total} parameters stands out from noise in {response}: which matter is not known."
    verb = "matter for" if known else "stand out for" if len(selected) > 1 else "stands out for"
    return f"Of {total} parameters {len(selected)} {verb} {response}: {names_of(selected)}."


def screening_section(folder: CampaignFolder) -> Section | None:
    """None without `screening.json`."""
    screening = folder["screening"]
    if screening is None:
        return None
    selected, path = list(screening["selected"]), list(screening["path"])
    total = len(screening["ranking"])
    sentences = [
        _which(screening, selected, total),
        *([said] if (said := minor_text(screening)) else []),
        f"Judged on {counted(screening['n_runs'], 'run')}"
        + (f" ({counted(lost, 'failed run')} left out)" if (lost := screening.get("n_left_out")) else "")
        + f", method {screening['method']}.",
        f"Criterion: {screening['criterion']}. Rule: {screening['rule']}.",
        *(typeset(f"{mode['sentence']}.") for mode in screening.get("modes") or ()),
    ]
    blocks: list[Block] = []
    if regimes := regime_text(screening):
        blocks.append(Note(text=" ".join(map(sentence, regimes)), level="fair"))
    if screening.get("verdict"):
        text = f"Verdict: {screening['verdict']}."
        if screening.get("advice"):
            text += f" Advice: {screening['advice']}."
        blocks.append(Note(text=text, level=verdict_level(screening)))
    if path:
        blocks.append(_path_figure(screening, path))
    theta = {str(k): float(v) for k, v in (screening.get("theta") or {}).items()}
    if theta:
        blocks.append(_theta_figure(screening, theta, selected))
    blocks += _shares(screening)
    return Section(
        id="screening",
        title="Which parameters matter",
        sentences=tuple(sentences),
        blocks=tuple(blocks),
        numbers={
            "response": screening["response"],
            "state": screening_state(screening),
            "hidden_share": screening.get("hidden_share"),
            "selected": selected,
            "minor": list(screening.get("minor") or []),
            "regimes": screening.get("regimes"),
            "ranking": list(screening["ranking"]),
            "theta": theta,
            "path": [
                {key: step.get(key) for key in ("step", "added", "log_likelihood", "gain", "accepted")}
                for step in path
            ],
        },
    )


def verdict_level(screening: Mapping[str, Any]) -> Level:
    """How loudly the screener's own verdict is said."""
    return LEVELS.get(screening_state(screening), "plain")


def threshold_of(screening: Mapping[str, Any]) -> float | None:
    """The gain that a step needs, when the document states it as a number."""
    found = screening.get("threshold", (screening.get("diagnosis") or {}).get("threshold"))
    return float(found) if isinstance(found, (int, float)) else None


def _path_figure(screening: Mapping[str, Any], path: list[dict[str, Any]]) -> Figure:
    threshold = threshold_of(screening)
    rejected = [step for step in path if not step.get("accepted", True)]
    # the first rejected step shows the threshold at work; the others are in the table
    shown = [step for step in path if step.get("accepted", True) or step is rejected[0]]
    bars = len(shown) <= MOST_BARS
    read_off = (
        "l is larger when the Kriging explains the runs better; a bar is the gain of one more θ of its own."
    )
    if rejected:
        last = rejected[0]
        read_off += (
            f" The rejected step ({_added(last) or 'last'}, gain {number(last.get('gain'), 3)}) is "
            f"{'hatched' if bars else 'a cross'}{_why_rejected(last, threshold)}."
        )
    if threshold is not None:
        read_off += f" A step needs a gain of at least {number(threshold, 3)}."

    if len(rejected) > 1:
        read_off += f" {len(rejected) - 1} more were tried after it and rejected; they stand in the table."

    def draw(ax: Any) -> Any:
        plot = plot_waterfall if bars else plot_likelihood_path
        return plot(shown, threshold=threshold, ax=ax)

    steps = [f"{_added(step) or 'start'} {number(step['log_likelihood'], 4)}" for step in path[:6]]
    return Figure(
        id="screening-path",
        title="Screening, step by step",
        alt=f"Restricted log-likelihood over {len(path)} steps: {', '.join(steps)}.",
        read_off=read_off,
        panels=(Panel(draw=draw, width=max(4.8, min(7.2, 1.4 + 0.62 * len(shown))), height=3.2),),
        table=Table(
            id="screening-path",
            title="Screening, step by step",
            columns=(
                Column(name="step"),
                Column(name="parameters with a θ of their own"),
                Column(name="common θ of the others"),
                Column(name="sigma^2", unit=_squared(str(screening.get("unit") or "1"))),
                Column(name="restricted log-likelihood l"),
                Column(name="gain"),
                Column(name="accepted"),
            ),
            rows=tuple(
                (
                    step.get("step", k),
                    ", ".join(step["selected"]),
                    step.get("theta_common"),
                    step.get("sigma2"),
                    step["log_likelihood"],
                    step.get("gain"),
                    bool(step.get("accepted", True)),
                )
                for k, step in enumerate(path)
            ),
            marked=frozenset(k for k, step in enumerate(path) if not step.get("accepted", True)),
        ),
    )


def _why_rejected(step: Mapping[str, Any], threshold: float | None) -> str:
    """That its gain is too small, where it is; a set may also lose to another one."""
    gain = step.get("gain")
    return ": too little to count" if threshold is not None and gain is not None and gain < threshold else ""


def _added(step: Mapping[str, Any]) -> str:
    added = step.get("added") or []
    return added if isinstance(added, str) else names_of(added)


def _squared(unit: str) -> str:
    return unit if unit in ("", "1") else f"({unit})^2"


def _theta_figure(screening: Mapping[str, Any], theta: dict[str, float], selected: list[str]) -> Figure:
    order = sorted(theta, key=lambda name: -theta[name])
    at_bound = list((screening.get("diagnosis") or {}).get("at_bound") or [])
    at_bound = [name for name in at_bound if name in theta]
    read_off = (
        "θ says how fast the response changes along a parameter. On this log axis a factor of two is little."
    )
    if any(value <= 0 for value in theta.values()):
        read_off += " An arrow at the left edge stands for zero."
    if at_bound:
        read_off += (
            f" {names_of(at_bound)} stand at the bound of the estimation (arrow): only an order of magnitude."
        )
    return Figure(
        id="theta",
        title="Correlation parameters θ",
        alt=f"θ of {len(theta)} parameters on a log axis, largest {order[0]} with "
        f"{number(theta[order[0]], 3)}.",
        read_off=read_off,
        panels=(
            Panel(
                draw=lambda ax: plot_theta(theta, selected=selected, at_bound=at_bound, ax=ax),
                width=5.0,
                height=1.0 + 0.2 * max(len(theta), 6),
            ),
        ),
        table=Table(
            id="theta",
            title="Correlation parameters θ",
            columns=(
                Column(name="parameter"),
                Column(name="θ"),
                Column(name="selected"),
                Column(name="at bound"),
            ),
            rows=tuple((name, theta[name], name in selected, name in at_bound) for name in order),
        ),
    )


def _shares(screening: Mapping[str, Any]) -> list[Block]:
    """Sobol' indices and stability over resampled runs, as one table."""
    sobol = screening.get("sobol") or {}
    total, main = dict(sobol.get("total") or {}), dict(sobol.get("main") or {})
    stability = dict(screening.get("stability") or {})
    names = [n for n in screening["ranking"] if n in total or n in stability]
    if not names:
        return []
    columns = [Column(name="parameter")]
    cells: list[dict[str, Any]] = []
    if total:
        columns += [Column(name="share of variance alone"), Column(name="with interactions")]
        cells += [main, total]
    if laws := sobol.get("averaged_over"):
        columns.append(Column(name="averaged over"))
        cells.append(laws)
    if stability:
        columns.append(Column(name="selected in this share of repeated screenings"))
        cells.append(stability)
    return [
        Table(
            id="shares",
            title="Shares of the variance of the response, by Kriging",
            columns=tuple(columns),
            rows=tuple((name, *(_plain(column.get(name)) for column in cells)) for name in names),
        )
    ]


def _plain(value: Any) -> Any:
    return value.get("value", value.get("mean")) if isinstance(value, dict) else value
