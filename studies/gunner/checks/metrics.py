"""What the figures of merit and the restraints were asked to show: M1 to M3, R1, R2.

Head injury and the 3 ms clip of a rectangular pulse, the vertical weighting of ISO 2631-1 at six frequencies,
the airbag law where it starts and near its end, and the counts of Appendix C.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from workbench.engine import ClipLevel, HeadInjury, WholeBodyFilter
from workbench.engine.elements.law_series import law_series

from ..cabin.facing import HATCH
from ..restraints.ground_structure import FLOOR, laws, sites
from ..vehicle.acceptance import Row, between, near

__all__ = ["CHECKS", "injuries", "table", "ties", "weighting"]

GRAVITY = 9.80665  # m/s^2, of the criteria
HEIGHT, LASTS = 100.0, 0.010  # g, s: of the pulse
STEP = 1e-5  # s, of the pulse; 1e-3 for the sines
SINES = (1.0, 2.0, 4.0, 8.0, 16.0, 31.5)  # Hz
# |Wk| of the annex's formula in closed form, checked against the table of the standard
F1, F2, F3, Q4, F5, Q5, F6, Q6 = 0.4, 100.0, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulse:
    """A series as a quantity."""

    series: np.ndarray
    has_rates: bool = False

    def values(self, trajectory: Any) -> np.ndarray:
        """(nodes,) m/s^2."""
        return self.series


def injuries() -> Iterator[Row]:
    """M1, M2: a rectangular pulse of 100 g over 10 ms: HIC15 = 0.010 x 100^2.5 = 1000, clip 100 g."""
    nodes, first = np.arange(5001), 2000
    times = STEP * nodes
    series = HEIGHT * GRAVITY * ((nodes >= first) & (nodes <= first + round(LASTS / STEP)))
    run, pulse = SimpleNamespace(times=times), Pulse(series=series)
    head: Any = HeadInjury(quantity=pulse)  # type: ignore[arg-type]
    clip: Any = ClipLevel(quantity=pulse)  # type: ignore[arg-type]
    yield near("M1", "HIC15 of 100 g over 10 ms", 1000.0, 1e-3, head.value(run), "1")
    yield near("M2", "3 ms clip of the same", 100.0, 1e-6, clip.value(run) / GRAVITY, "g")


def wk(f: float) -> float:
    """|Wk| at a frequency, Hz, by the formula of the standard's annex A."""
    p = 1j * f
    band = p**2 / (p**2 + np.sqrt(2.0) * F1 * p + F1**2) / (1.0 + np.sqrt(2.0) * p / F2 + (p / F2) ** 2)
    slope = (1.0 + p / F3) / (1.0 + p / (Q4 * F3) + (p / F3) ** 2)
    step = (1.0 + p / (Q5 * F5) + (p / F5) ** 2) / (1.0 + p / (Q6 * F6) + (p / F6) ** 2) * (F5 / F6) ** 2
    return float(abs(band * slope * step))


def weighting() -> Iterator[Row]:
    """M3: the rms of weighted sines, over whole periods once they have settled."""
    step, after = 1e-3, 20.0
    times = np.arange(0.0, after + 20.0, step)
    for f in SINES:
        seen = WholeBodyFilter(weighting="Wk").applied(np.sin(2.0 * np.pi * f * times), step)
        gain = float(np.sqrt(2.0 * np.mean(seen[times >= after] ** 2)))
        yield near("M3", f"Wk of a sine of {f:g} Hz", wk(f), 0.01, gain, "1")


def ties() -> Iterator[Row]:
    """R1, R2: the airbag law (8.27), and what Appendix C counts."""
    bag = laws()["airbag"]
    way = -np.linspace(0.0, 0.20, 401)
    force = law_series([bag], way[:, None], np.zeros((len(way), 1)), np.zeros(len(way))).force[:, 0]
    at = {delta: float(np.interp(-delta, -way, force)) for delta in (-0.005, -0.13)}
    yield between("R1", "airbag at -5 mm", -0.01, 0.01, at[-0.005], "N")
    yield between("R1", "airbag at -130 mm", -1117.5, -1116.5, at[-0.13], "N")
    yield between("R1", "largest step towards pulling", -np.inf, 1e-9, np.diff(force).max(), "N")
    yield between("R2", "members of a kind", 180, 180, len(sites()), "1")
    yield between("R2", "of them to the floor", 36, 36, sum(s.layer == FLOOR for s in sites()), "1")
    radii = [np.hypot(s.on_vehicle[0] - HATCH[0], s.on_vehicle[1] - HATCH[1]) for s in sites()]
    yield between("R2", "radius of the octagon, least", 0.3997, 0.4003, float(min(radii)), "m")
    yield between("R2", "radius of the octagon, largest", 0.3997, 0.4003, float(max(radii)), "m")


CHECKS = (injuries, weighting, ties)


def table(checks: Any = CHECKS) -> list[Row]:
    """All rows."""
    return [row for check in checks for row in check()]
