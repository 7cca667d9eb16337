"""The Kriging of the parameters that act: leave-one-out, main effects and Sobol' indices are those of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from surrogates import Kriging, KrigingScreener, Measure, main_effects, selected_kriging, sobol_indices
from surrogates.analysis.response_map import ResponseMap, response_map
from workbench.space.box import Space
from workbench.space.laws import input_law, input_measure
from workbench.space.streams import stream

__all__ = ["SelectedKriging"]

CURVE_POINTS = 25
SOBOL_DRAWS = 60


@dataclass(frozen=True, slots=True)
class SelectedKriging:
    """The Kriging of the parameters that act, and what is read off it, in plain types.

    predictor: of the response on `scale`, which predicts it best
    columns: those selected or listed apart, of x (n, d) in [0, 1]    seed: of the draws of Sobol' indices
    """

    columns: list[int]
    predictor: Kriging
    scale: ResponseMap
    x: np.ndarray
    seed: int

    @classmethod
    def fit(
        cls,
        screener: KrigingScreener,
        x: np.ndarray,
        y: np.ndarray,
        ids: list[str],
        seed: int,
        scale: str = "none",
    ) -> "SelectedKriging":
        """Fit it to the columns that a screening selected or lists apart; y (n,) in the response's unit.

        It is fitted on `scale`, on which ranks tell nothing beyond the runs and count as none; predictions,
        effects and indices are carried back: they are of the response.
        """
        columns = sorted([*screener.selected_.tolist(), *screener.minor_.tolist()])
        mapped = response_map(y, "none" if scale == "ranks" else scale)
        predictor = selected_kriging(screener, x, mapped.forward(y), minor=True, run_ids=ids)
        return cls(columns, predictor, mapped, x, seed)

    def _by_name(self, values: np.ndarray, names: Sequence[str]) -> dict[str, float]:
        return {names[k]: float(v) for k, v in zip(self.columns, values, strict=True)}

    def kriging(self, names: Sequence[str]) -> dict[str, Any]:
        """Parameters of the Kriging that predicts, theta by name, and the scale that it is of."""
        k = self.predictor
        return {
            "scale": self.scale.scale,
            "scale_in_words": self.scale.words,
            "trend": "constant",
            "correlation": str(k.correlation),
            "eta": float(k.eta),
            "theta": self._by_name(k.theta_, names),
            "sigma2": float(k.sigma2_),
            "nugget": float(k.nugget_),
            "beta": [float(b) for b in np.ravel(k.beta_)],
            "log_likelihood": float(k.log_likelihood_),
            "calibration": "cross_validation" if k.intervals == "calibrated" else "none",
            "interval_factor": float(k.interval_factor_),
        }

    def leave_one_out(self) -> dict[str, Any]:
        """What is predicted of each run without that run, in the response's unit.

        On another scale the median is predicted, and `std` is half of what one deviation to both sides
        spans; errors in standard deviations are those of the scale, on which they are symmetric.
        """
        left, back = self.predictor.leave_one_out(), self.scale.inverse
        found = {
            "run_ids": list(left.run_ids),
            "observed": left.observed,
            "predicted": left.prediction,
            "std": left.std,
            "standardised": left.standardised,
            "q2": left.q2,
            "coverage95": left.coverage95,
        }
        if self.scale.scale == "none":
            return found
        usable = np.isfinite(left.std)
        return found | {
            "observed": back(left.observed),
            "predicted": back(left.prediction),
            "std": 0.5 * (back(left.prediction + left.std) - back(left.prediction - left.std)),
            "q2": self.scale.q2(left.observed[usable], left.prediction[usable]),
        }

    def main_effects(self, space: Space) -> dict[str, Any]:
        """The mean response over each selected parameter, in its own unit, with a band of 95 %."""
        found = {}
        effects = main_effects(
            self.predictor, points=CURVE_POINTS, measures=self._measures(space), carried=self.scale
        )
        for k, effect in zip(self.columns, effects, strict=True):
            parameter = space.parameters[k]
            x = np.asarray(effect.x, dtype=float)
            if parameter.kind == "categorical":  # the Kriging numbers the labels of the runs 0, 1, ...
                x = np.unique(self.x[:, k])[np.asarray(x, dtype=int)]
            found[parameter.name] = {
                "x": parameter.physical(np.clip(x, 0.0, 1.0)).tolist(),
                "mean": effect.mean,
                "lower": effect.lower,
                "upper": effect.upper,
            }
        return found

    def _measures(self, space: Space) -> list[Measure | None]:
        return [input_measure(space.parameters[k]) for k in self.columns]

    def sobol(self, space: Space) -> dict[str, Any]:
        """Main, total and pairwise indices by name, with bands of 95 %; pairs of up to 12 parameters."""
        names, k = space.names, len(self.columns)
        pairs = [(i, j) for i in range(k) for j in range(i + 1, k)] if k <= 12 else []
        indices = sobol_indices(
            self.predictor,
            draws=SOBOL_DRAWS,
            pairs=pairs,
            measures=self._measures(space),
            carried=self.scale,
            rng=stream(self.seed, "sobol"),
        )
        found: dict[str, Any] = {
            "averaged_over": {names[k]: input_law(space.parameters[k]) for k in self.columns}
        }
        for kind, part in (("main", indices.main), ("total", indices.total)):
            found[kind] = self._by_name(part.mean, names)
            found[f"{kind}_lower"] = self._by_name(part.lower, names)
            found[f"{kind}_upper"] = self._by_name(part.upper, names)
        found["interactions"] = [
            {
                "pair": [names[self.columns[i]], names[self.columns[j]]],
                "mean": float(indices.interaction.mean[at]),
                "lower": float(indices.interaction.lower[at]),
                "upper": float(indices.interaction.upper[at]),
            }
            for at, (i, j) in enumerate(indices.pairs)
        ]
        return found
