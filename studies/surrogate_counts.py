"""What Kriging as imported, bands of Sobol' indices and screenings over three decades are worth, counted.

    python -m studies.surrogate_counts kriging 4100 10    intervals and errors of `Kriging()`, 11 functions
    python -m studies.surrogate_counts bands 8100 10      95 % bands of main and total indices, 3 functions
    python -m studies.surrogate_counts decades 61000 12   screenings of drawn functions over three decades
    python -m studies.surrogate_counts carried 71000 8    bands of these, as they are and carried back

The first number is the seed of all designs, the second how many samples, or functions, are counted. No rule
was chosen on these functions. The last counts are in
docs/decisions/0198-three-counts-that-move-no-rule.md and 0250-indices-are-carried-back.md.
"""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

import doe
from studies.held_out_functions import held_out
from studies.screening_lists import jansen_indices
from studies.screening_scales import over_decades
from surrogates import (
    Kriging,
    KrigingScreener,
    ScaledKriging,
    choose_scale,
    judged_on_response,
    on_scale,
    sobol_indices,
)

__all__ = ["BANDS", "FUNCTIONS", "bands", "carried", "decades", "kriging", "main"]

Array = NDArray[np.float64]
Function = Callable[[Array], Array]

FRESH = 1000  # points at which predictions are judged
QUANTILE = 1.959964  # of the normal law: 95 %
RIVALS = ("gaussian", "matern52")
BASE, BASE_OF_DECADES = 2**15, 2**13  # of the Sobol' points of true indices
ROUNDING = 1e-3  # of true indices
LARGE = 0.05  # a total index that a list should hold


def ishigami(u: Array) -> Array:
    """Ishigami and Homma 1990, a = 7, b = 0.1."""
    x = 2.0 * np.pi * u - np.pi
    return np.asarray(np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0]))


def friedman(u: Array) -> Array:
    """Friedman 1991, without inert inputs."""
    waves = 10.0 * np.sin(np.pi * u[:, 0] * u[:, 1])
    return np.asarray(waves + 20.0 * (u[:, 2] - 0.5) ** 2 + 10.0 * u[:, 3] + 5.0 * u[:, 4])


def sobol_g(u: Array) -> Array:
    """Sobol's g with a = 0, 1, 4.5, 9."""
    a = np.array([0.0, 1.0, 4.5, 9.0])
    return np.asarray(np.prod((np.abs(4.0 * u - 2.0) + a) / (1.0 + a), axis=1))


def hartmann(u: Array) -> Array:
    """Hartmann's function of three inputs."""
    a = np.array([[3.0, 10, 30], [0.1, 10, 35], [3.0, 10, 30], [0.1, 10, 35]])
    p = 1e-4 * np.array([[3689, 1170, 2673], [4699, 4387, 7470], [1091, 8732, 5547], [381, 5743, 8828]])
    return np.asarray(-np.exp(-((u[:, None, :] - p) ** 2 * a).sum(2)) @ np.array([1.0, 1.2, 3.0, 3.2]))


def otl_circuit(u: Array) -> Array:
    """Midpoint voltage of a push-pull circuit without output transformer (Ben-Ari and Steinberg 2007)."""
    low, high = np.array([50, 25, 0.5, 1.2, 0.25, 50]), np.array([150, 70, 3, 2.5, 1.2, 300])
    b1, b2, f, c1, c2, beta = (low + (high - low) * u).T
    base = beta * (c2 + 9.0)
    vb = 12.0 * b2 / (b1 + b2)
    return np.asarray(
        (vb + 0.74) * base / (base + f) + 11.35 * f / (base + f) + 0.74 * f * base / ((base + f) * c1)
    )


def wing_weight(u: Array) -> Array:
    """Weight of a light aircraft's wing (Forrester, Sobester and Keane 2008)."""
    low = np.array([150, 220, 6, -10, 16, 0.5, 0.08, 2.5, 1700, 0.025])
    high = np.array([200, 300, 10, 10, 45, 1, 0.18, 6, 2500, 0.08])
    s, wfw, a, sweep, q, taper, tc, nz, wdg, wp = (low + (high - low) * u).T
    cosine = np.cos(np.radians(sweep))
    weight = 0.036 * s**0.758 * wfw**0.0035 * (a / cosine**2) ** 0.6 * q**0.006 * taper**0.04
    return np.asarray(weight * (100.0 * tc / cosine) ** -0.3 * (nz * wdg) ** 0.49 + s * wp)


def robot_arm(u: Array) -> Array:
    """Reach of an arm of three links: three angles, three lengths."""
    angles = np.cumsum(2.0 * np.pi * u[:, :3], axis=1)
    return np.hypot((u[:, 3:] * np.cos(angles)).sum(1), (u[:, 3:] * np.sin(angles)).sum(1))


# name -> inputs, runs, function over the unit cube
FUNCTIONS: Mapping[str, tuple[int, int, Function]] = {
    "branin": (2, 25, held_out("branin").evaluate), "hartmann": (3, 40, hartmann),
    "ishigami": (3, 70, ishigami), "sobol g": (4, 60, sobol_g), "friedman": (5, 50, friedman),
    "otl circuit": (6, 50, otl_circuit), "robot arm": (6, 80, robot_arm),
    "piston": (7, 60, held_out("piston").evaluate), "borehole": (8, 60, held_out("borehole").evaluate),
    "wing weight": (10, 60, wing_weight), "chain": (6, 45, held_out("chain").evaluate),
}  # fmt: skip

# name -> inputs, runs, function, noise as a share of the response's deviation
BANDS: Mapping[str, tuple[int, int, Function, float]] = {
    "branin": (2, 25, held_out("branin").evaluate, 0.0),
    "piston with noise": (7, 60, held_out("piston").evaluate, 0.1),
    "sobol g": (4, 60, sobol_g, 0.0),
}


def kriging(
    seed: int, samples: int, names: Sequence[str] = tuple(FUNCTIONS)
) -> dict[str, tuple[float, float]]:
    """name -> share of new points inside the 95 % intervals, and error over the better rival's.

    Random Latin hypercubes; errors are root mean squares, averaged geometrically over the samples; rivals
    have a constant trend and plug-in intervals.
    """
    found = {}
    for name in names:
        d, n, f = FUNCTIONS[name]
        held, errors = [], []
        for k in range(samples):
            rng = np.random.default_rng([seed, k, len(name)])
            u = (np.argsort(rng.random((n, d)), axis=0) + rng.random((n, d))) / n
            fresh = rng.random((FRESH, d))
            y, true = f(u), f(fresh)
            mean, deviation = Kriging().fit(u, y).predict(fresh, return_std=True)
            held.append(np.mean(np.abs(true - mean) <= QUANTILE * deviation))
            others = [
                Kriging(correlation=c, trend="constant", intervals="plug-in").fit(u, y).predict(fresh)
                for c in RIVALS
            ]
            errors.append([np.sqrt(np.mean((true - p) ** 2)) for p in (mean, *others)])
        mine, *rest = np.exp(np.mean(np.log(errors), axis=0))
        found[name] = float(np.mean(held)), float(mine / min(rest))
    return found


def true_indices(f: Function, d: int) -> tuple[Array, Array]:
    """Main and total Sobol' indices by Jansen's estimators on Sobol' points."""
    points = doe.sobol(BASE, 2 * d, rng=np.random.default_rng(0))
    a, b = points[:, :d], points[:, d:]
    fa, fb = f(a), f(b)
    variance = np.concatenate([fa, fb]).var()
    main, total = np.empty(d), np.empty(d)
    for j in range(d):
        mixed = a.copy()
        mixed[:, j] = b[:, j]
        fc = f(mixed)
        total[j] = 0.5 * np.mean((fa - fc) ** 2) / variance
        main[j] = 1.0 - 0.5 * np.mean((fb - fc) ** 2) / variance
    return np.maximum(main, 0.0), np.maximum(total, 0.0)  # estimates of nothing fall on either side of it


def bands(seed: int, samples: int, names: Sequence[str] = tuple(BANDS)) -> dict[str, tuple[int, int, float]]:
    """name -> true main and total indices inside their bands, how many there are, and the mean width.

    Designs are random and optimised Latin hypercubes by turns.
    """
    found = {}
    for name in names:
        d, n, f, noise = BANDS[name]
        true, held, widths = true_indices(f, d), 0, []
        for k in range(samples):
            rng = np.random.default_rng([seed, k, d])
            u = doe.lhs(n, d, rng=rng) if k % 2 else doe.optimised_lhs(n, d, swaps=20_000, rng=rng)
            y = f(u)
            y = y + noise * y.std() * rng.standard_normal(n)
            indices = sobol_indices(Kriging().fit(u, y), rng=np.random.default_rng(k))
            for exact, band in zip(true, (indices.main, indices.total), strict=True):
                held += int(((exact >= band.lower - ROUNDING) & (exact <= band.upper + ROUNDING)).sum())
                widths.append(np.mean(band.upper - band.lower))
        found[name] = held, 2 * d * samples, float(np.mean(widths))
    return found


def averaged_indices(f: Function, d: int) -> tuple[Array, Array]:
    """The same of a response over decades: a Gauss rule along each input, from Sobol' points of the others.

    Both variances of a quotient come from the same points, so that it bears few large values.
    """
    points = doe.sobol(BASE_OF_DECADES, d, rng=np.random.default_rng(0))
    at, weights = np.polynomial.legendre.leggauss(16)
    main, total = np.empty(d), np.empty(d)
    for j in range(d):
        along = np.repeat(points[:, None, :], len(at), axis=1)
        along[:, :, j] = 0.5 + 0.5 * at
        y = f(along.reshape(-1, d)).reshape(len(points), -1)
        within, squares = y @ weights / 2, float((y**2 @ weights).mean() / 2)
        variance = squares - within.mean() ** 2
        main[j] = (y.mean(axis=0) - within.mean()) ** 2 @ weights / 2 / variance
        total[j] = (squares - np.mean(within**2)) / variance
    return main, total


def carried(seed: int, functions: int) -> Iterator[dict[str, Any]]:
    """Bands of functions over two and three decades: held, of how many, mean width and error of the mean.

    Of a Kriging of the response itself, and of one on the scale that predicts best, carried back.
    """
    for k in range(functions):
        for span in (2, 3):
            f = over_decades(seed + 13 * k, span)
            true = averaged_indices(f.evaluate, f.d)
            rng = np.random.default_rng([seed, k, span])
            u = doe.optimised_lhs(5 * f.d + 6, f.d, swaps=20_000, rng=rng)
            y = f.evaluate(u)
            row: dict[str, Any] = {"function": k, "decades": span, "inputs": f.d}
            for name in ("none", "auto"):
                model = ScaledKriging(scale=name).fit(u, y)
                found = sobol_indices(model.kriging_, carried=model.map_, rng=np.random.default_rng(k))
                bands = tuple(zip(true, (found.main, found.total), strict=True))
                row[name] = {
                    "scale": model.map_.scale,
                    "q2": model.q2_,
                    "held": sum(
                        int(((exact >= b.lower - ROUNDING) & (exact <= b.upper + ROUNDING)).sum())
                        for exact, b in bands
                    ),
                    "width": float(np.mean([b.upper - b.lower for _, b in bands])),
                    "error": float(np.max([np.abs(exact - b.mean).max() for exact, b in bands])),
                }
            yield row


def decades(seed: int, functions: int) -> Iterator[dict[str, Any]]:
    """A row for each screening: state, x, true total indices above 5 % and above x that it lacks."""
    for k in range(functions):
        f = over_decades(seed + 13 * k, 3)
        total = jansen_indices(f)
        for noise in (0.0, 0.05):
            rng = np.random.default_rng([seed, k, round(100 * noise)])
            u = doe.optimised_lhs(5 * f.d + 6, f.d, swaps=20_000, rng=rng)
            y = f.evaluate(u)
            y = y + noise * y.std() * rng.standard_normal(len(y))
            scale = choose_scale(KrigingScreener(), u, y).scale
            screened = KrigingScreener().fit(u, on_scale(y, scale))
            judged_on_response(screened, u, y, scale)
            listed = np.array(screened.get_support())
            seen = listed.copy()
            seen[list(screened.minor_)] = True
            x = float(screened.diagnosis_.hidden_share)
            yield {
                "function": k, "noise": noise, "scale": scale, "state": screened.diagnosis_.state, "x": x,
                "lacks": total[~listed & (total > LARGE)], "beyond": total[~seen & (total > x)],
            }  # fmt: skip


def main(what: str, seed: int, number: int) -> None:
    """Print a count."""
    if what == "kriging":
        for name in FUNCTIONS:
            held, error = kriging(seed, number, [name])[name]
            print(
                f"{name:18s} intervals hold {held:6.1%}   error {error:.2f} of the better rival's", flush=True
            )
    elif what == "bands":
        for name in BANDS:
            inside, of, width = bands(seed, number, [name])[name]
            print(f"{name:18s} {inside} of {of} held, mean width {width:.3f}", flush=True)
    elif what == "carried":
        rows = []
        for row in carried(seed, number):
            rows.append(row)
            print(
                f"{row['function']:3d}  {row['decades']} decades  "
                + "   ".join(
                    f"{one['scale']:8s} Q2 {one['q2']:.3f}  {one['held']} of {2 * row['inputs']} held, width "
                    f"{one['width']:.3f}, largest error {one['error']:.3f}"
                    for one in (row["none"], row["auto"])
                ),
                flush=True,
            )
        all_of = 2 * sum(row["inputs"] for row in rows)
        for name in ("none", "auto"):
            print(
                f"{name}: {sum(row[name]['held'] for row in rows)} of {all_of} held, mean width "
                f"{np.mean([row[name]['width'] for row in rows]):.3f}, median of the largest errors "
                f"{np.median([row[name]['error'] for row in rows]):.3f}"
            )
    elif what == "decades":
        rows = []
        for row in decades(seed, number):
            rows.append(row)
            print(
                f"{row['function']:3d}  noise {row['noise']:.2f}  {row['scale']:12s} {row['state']:16s} "
                f"x {row['x']:6.1%}  lacks {np.round(row['lacks'], 3)}  beyond {np.round(row['beyond'], 3)}",
                flush=True,
            )
        print(
            f"{len(rows)} screenings, {sum(r['state'] == 'resolved' for r in rows)} resolved; "
            f"{sum(len(r['beyond']) > 0 for r in rows)} lack an input above x, "
            f"{sum(len(r['lacks']) > 0 for r in rows)} one above {LARGE:.0%}; "
            f"median x {np.median([r['x'] for r in rows]):.1%}"
        )
    else:
        raise SystemExit(f"counts are kriging, bands, carried, decades, got {what}")


if __name__ == "__main__":
    what, first, count = (*sys.argv[1:], *("kriging", "4100", "10")[len(sys.argv) - 1 :])[:3]
    main(what, int(first), int(count))
