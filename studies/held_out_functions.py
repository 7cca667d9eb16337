"""Thirty functions on the unit cube that no study of screenings held: 18 from the literature, 12 composed.

The composed ones follow Becker (Environ. Model. Softw. 128, 2020): each input gets one of ten shapes, pairs
and triples of inputs act as products, and coefficients come from two normal laws, most of them small.

    y = sum_k a_k f_k(x_k) + sum b f_i f_j + sum c f_i f_j f_k,      a, b, c ~ 0.7 N(0, 0.5^2) + 0.3 N(0, 5^2)

Functions of fewer inputs than a study has get inert ones.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from studies.screening_lists import Listed

__all__ = ["COMPOSED", "PUBLISHED", "composed_function", "held_out"]

Array = NDArray[np.float64]
Bounds = Sequence[tuple[float, float]]


def _scaled(bounds: Bounds, x: Array) -> Array:
    """The first columns of x (n, d) in their own units, (len(bounds), n)."""
    low, high = np.array(bounds, dtype=float).T
    return np.asarray((low + (high - low) * x[:, : len(low)]).T)


def _borehole(x: Array) -> Array:
    """Flow of water through a borehole, Harper and Gupta (1983)."""
    rw, r, tu, hu, tl, hl, length, kw = _scaled(
        [(0.05, 0.15), (100, 5e4), (63070, 115600), (990, 1110), (63.1, 116), (700, 820), (1120, 1680),
         (9855, 12045)], x
    )  # fmt: skip
    log = np.log(r / rw)
    return np.asarray(
        2 * np.pi * tu * (hu - hl) / (log * (1 + 2 * length * tu / (log * rw**2 * kw) + tu / tl))
    )


def _piston(x: Array) -> Array:
    """Cycle time of a piston in a cylinder, Ben-Ari and Steinberg (2007)."""
    m, s, v0, k, p0, ta, t0 = _scaled(
        [(30, 60), (0.005, 0.02), (0.002, 0.01), (1000, 5000), (9e4, 1.1e5), (290, 296), (340, 360)], x
    )
    a = p0 * s + 19.62 * m - k * v0 / s
    v = s / (2 * k) * (np.sqrt(a**2 + 4 * k * p0 * v0 / t0 * ta) - a)
    return np.asarray(2 * np.pi * np.sqrt(m / (k + s**2 * p0 * v0 / t0 * ta / v**2)))


def _roof_truss(x: Array) -> Array:
    """Deflection of the peak of a roof truss of concrete and steel."""
    q, length, a_steel, a_concrete, e_steel, e_concrete = _scaled(
        [(18e3, 22e3), (11.5, 12.5), (8.5e-4, 11e-4), (0.034, 0.046), (0.9e11, 1.1e11), (1.7e10, 2.3e10)], x
    )
    return np.asarray(0.5 * q * length**2 * (3.81 / (a_concrete * e_concrete) + 1.13 / (a_steel * e_steel)))


def _column(x: Array) -> Array:
    """Margin of a steel column with an initial bow against yield."""
    area, width, thick, height, bow, strength, dead, live, modulus = _scaled(
        [(0.9, 1.1), (280, 320), (16, 24), (270, 330), (20, 40), (340, 460), (4e5, 6e5), (5e5, 7e5),
         (1.9e5, 2.3e5)], x
    )  # fmt: skip
    load, section = dead + live, 2 * width * thick * area
    euler = np.pi**2 * modulus * width * thick * height**2 / (2 * 7500.0**2)
    return np.asarray(
        strength - load * (1 / section + bow / (width * thick * height) * euler / (euler - load))
    )


def _speed_reducer(x: Array) -> Array:
    """Mass of a speed reducer, Golinski (1970)."""
    face, module, teeth, l1, l2, d1, d2 = _scaled(
        [(2.6, 3.6), (0.7, 0.8), (17, 28), (7.3, 8.3), (7.3, 8.3), (2.9, 3.9), (5.0, 5.5)], x
    )
    return np.asarray(
        0.7854 * face * module**2 * (3.3333 * teeth**2 + 14.9334 * teeth - 43.0934)
        - 1.508 * face * (d1**2 + d2**2)
        + 7.477 * (d1**3 + d2**3)
        + 0.7854 * (l1 * d1**2 + l2 * d2**2)
    )


def _oscillator(x: Array) -> Array:
    """Peak force in the secondary spring of a two-mass system under white noise, Der Kiureghian (1990)."""
    mp, ms, kp, ks, zp, zs, s0 = _scaled(
        [(1.2, 1.8), (0.008, 0.012), (0.8, 1.2), (0.008, 0.012), (0.03, 0.07), (0.01, 0.03), (80, 120)], x
    )
    wp, ws = np.sqrt(kp / mp), np.sqrt(ks / ms)
    wa, za, gamma, theta = (wp + ws) / 2, (zp + zs) / 2, ms / mp, (wp - ws) / ((wp + ws) / 2)
    mean = np.pi * s0 / (4 * zs * ws**3)
    mean *= za * zs / (zp * zs * (4 * za**2 + theta**2) + gamma * za**2)
    mean *= (zp * wp**3 + zs * ws**3) * wp / (4 * za * wa**4)
    return np.asarray(3 * ks * np.sqrt(mean))


def _reaction(x: Array) -> Array:
    """Concentration of B in A -> B -> C after a time, both rates by Arrhenius."""
    log_k1, log_k2, e1, e2, temperature, time, a0 = _scaled(
        [(0.8, 1.2), (-1.2, -0.6), (35e3, 45e3), (55e3, 65e3), (330, 350), (0.5, 1.5), (0.9, 1.1)], x
    )
    hot = (1 / 340 - 1 / temperature) / 8.314
    k1, k2 = np.exp(log_k1 + e1 * hot), np.exp(log_k2 + e2 * hot)
    return np.asarray(a0 * k1 / (k2 - k1) * (np.exp(-k1 * time) - np.exp(-k2 * time)))


def _exchanger(x: Array) -> Array:
    """Heat that a counterflow exchanger passes on, by its number of transfer units."""
    hot, cold, area, u, t_hot, t_cold, fouling = _scaled(
        [(0.8, 1.2), (1.0, 1.6), (8, 12), (300, 500), (350, 370), (285, 300), (0, 4e-4)], x
    )
    rates = np.stack([4180 * hot, 4180 * cold])
    least, most = rates.min(axis=0), rates.max(axis=0)
    ntu, ratio = area / (1 / u + fouling) / least, least / most
    decay = np.exp(-ntu * (1 - ratio))
    return np.asarray((1 - decay) / (1 - ratio * decay) * least * (t_hot - t_cold))


def _bratley(x: Array) -> Array:
    """Alternating sum of growing products, Bratley, Fox and Niederreiter (1992)."""
    return np.asarray(np.cumprod(x[:, :8], axis=1) @ (-1.0) ** np.arange(1, 9))


def _morris(x: Array) -> Array:
    """Five inputs and all their pairs, the others inert; Morris, Moore and McKay (2006)."""
    z = x[:, :5]
    pairs = 0.5 * (z.sum(axis=1) ** 2 - (z**2).sum(axis=1))
    return np.asarray(0.9 * z.sum(axis=1) + 0.6 * pairs)


def _gramacy(x: Array) -> Array:
    """Four of twelve inputs, one of them with a wave that quickens; Gramacy and Lee (2009)."""
    return np.asarray(np.exp(np.sin((0.9 * (x[:, 0] + 0.48)) ** 10)) + x[:, 1] * x[:, 2] + x[:, 3])


def _park(x: Array) -> Array:
    """Park (1991), four inputs."""
    z = 0.02 + 0.98 * x[:, :4]
    first = z[:, 0] / 2 * (np.sqrt(1 + (z[:, 1] + z[:, 2] ** 2) * z[:, 3] / z[:, 0] ** 2) - 1)
    return np.asarray(first + (z[:, 0] + 3 * z[:, 3]) * np.exp(1 + np.sin(z[:, 2])))


def _currin(x: Array) -> Array:
    """Currin, Mitchell, Morris and Ylvisaker (1988), two inputs."""
    u, v = x[:, 0], 0.02 + 0.98 * x[:, 1]
    return np.asarray(
        (1 - np.exp(-0.5 / v))
        * (2300 * u**3 + 1900 * u**2 + 2092 * u + 60)
        / (100 * u**3 + 500 * u**2 + 4 * u + 20)
    )


def _branin(x: Array) -> Array:
    """Branin's function, two inputs."""
    u, v = 15 * x[:, 0] - 5, 15 * x[:, 1]
    bowl = (v - 5.1 / (4 * np.pi**2) * u**2 + 5 / np.pi * u - 6) ** 2
    return np.asarray(bowl + 10 * (1 - 1 / (8 * np.pi)) * np.cos(u) + 10)


def _dixon_price(x: Array) -> Array:
    """Dixon and Price (1971), five inputs: weights grow and neighbours act together."""
    z = 4 * x[:, :5] - 2
    return np.asarray((z[:, 0] - 1) ** 2 + ((2 * z[:, 1:] ** 2 - z[:, :-1]) ** 2) @ np.arange(2, 6))


def _chain(x: Array) -> Array:
    """Lowest frequency of a chain of three masses and three springs."""
    m1, m2, m3, k1, k2, k3 = _scaled([(0.8, 1.2)] * 3 + [(70, 130), (80, 120), (90, 110)], x)
    zero = np.zeros_like(k1)
    stiffness = np.array([[k1 + k2, -k2, zero], [-k2, k2 + k3, -k3], [zero, -k3, k3]]).transpose(2, 0, 1)
    size = 1 / np.sqrt(np.stack([m1, m2, m3], axis=1))
    scaled = stiffness * size[:, :, None] * size[:, None, :]
    return np.asarray(np.sqrt(np.linalg.eigvalsh(scaled)[:, 0]))


def _orifice(x: Array) -> Array:
    """Time that a tank needs to drain through an orifice into a pipe with friction."""
    height, diameter, hole, pipe, friction, discharge = _scaled(
        [(1.5, 2.5), (0.9, 1.1), (0.018, 0.022), (2, 6), (0.015, 0.035), (0.58, 0.66)], x
    )
    loss = 1 / discharge**2 + friction * pipe / (2 * hole)
    return np.asarray((diameter / hole) ** 2 * np.sqrt(2 * height * loss / 9.81))


def _fatigue(x: Array) -> Array:
    """Logarithm of the cycles that a notched bar bears, by Basquin and Gerber."""
    load, mean, width, thick, notch, strength, exponent, finish = _scaled(
        [(18e3, 24e3), (6e3, 12e3), (0.038, 0.042), (0.009, 0.011), (1.6, 2.2), (5.5e8, 6.5e8),
         (-0.11, -0.09), (0.8, 0.95)], x
    )  # fmt: skip
    area = width * thick
    amplitude = notch * load / area / (1 - (mean / area / strength) ** 2)
    return np.asarray(np.log10(0.5 * (amplitude / (1.5 * strength * finish)) ** (1 / exponent)))


PUBLISHED: dict[str, Listed] = {
    "borehole": Listed(10, _borehole), "piston": Listed(9, _piston), "roof truss": Listed(8, _roof_truss),
    "column": Listed(9, _column), "speed reducer": Listed(10, _speed_reducer),
    "oscillator": Listed(8, _oscillator), "reaction": Listed(9, _reaction),
    "exchanger": Listed(9, _exchanger), "bratley": Listed(8, _bratley), "morris": Listed(15, _morris),
    "gramacy": Listed(12, _gramacy),
    "park": Listed(8, _park), "currin": Listed(8, _currin), "branin": Listed(8, _branin),
    "dixon-price": Listed(9, _dixon_price), "chain": Listed(9, _chain), "orifice": Listed(9, _orifice),
    "fatigue": Listed(10, _fatigue),
}  # fmt: skip
COMPOSED = tuple(f"composed {k}" for k in range(12))

SHAPES: tuple[Callable[[Array], Array], ...] = (
    lambda z: z, lambda z: z**2, lambda z: z**3, lambda z: np.exp(z) / (np.e - 1),
    lambda z: np.sin(2 * np.pi * z) / 2, lambda z: np.where(z > 0.5, 1.0, 0.0), lambda z: 4 * (z - 0.5) ** 2,
    lambda z: 1 / (10 - 1 / 1.1) / (z + 0.1), lambda z: np.asarray(np.cos(z)), lambda z: 0.0 * z,
)  # fmt: skip


def composed_function(seed: int) -> Listed:
    """A function of 7 to 15 inputs as the module's docstring says."""
    rng = np.random.default_rng([128, seed])
    d = int(rng.integers(7, 16))
    chosen = [SHAPES[int(k)] for k in rng.integers(len(SHAPES), size=d)]

    def coefficients(count: int) -> Array:
        return np.asarray(np.where(rng.random(count) < 0.7, 0.5, 5.0) * rng.standard_normal(count))

    single = coefficients(d)
    pairs = [tuple(rng.choice(d, 2, replace=False).tolist()) for _ in range(d // 2)]
    triples = [tuple(rng.choice(d, 3, replace=False).tolist()) for _ in range(d // 5)]
    products = [*pairs, *triples]
    joint = coefficients(len(products))

    def evaluate(x: Array) -> Array:
        shaped = np.column_stack([f(x[:, k]) for k, f in enumerate(chosen)])
        return np.asarray(
            shaped @ single
            + sum(a * shaped[:, list(which)].prod(axis=1) for a, which in zip(joint, products, strict=True))
        )

    return Listed(d, evaluate)


def held_out(name: str) -> Listed:
    """One of PUBLISHED, or "composed k" for any k."""
    return PUBLISHED[name] if name in PUBLISHED else composed_function(int(name.removeprefix("composed ")))
