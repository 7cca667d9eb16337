"""A law of the user's as machine code, in every kind of system: as the engine's own, with all gradients."""

import numpy as np
import pytest

from tests.sample_masses import (
    DENSITY,
    check_gradients_by_densities,
    farthest,
    natural,
    planar,
    run_of,
    tree,
)
from workbench.engine import (
    CompiledLaw,
    IndependentAlpha,
    RungeKutta8,
    Spring,
    parameter_gradient,
    parameter_slopes,
    simulate,
)


def linear(delta, rate, t, k, c):
    return k * delta + c * rate


def damper(delta, rate, t, k, cubic, c, v0):
    """A stiffening spring beside a damper that saturates, both fading with time."""
    return (k * delta + cubic * delta**3 + c * v0 * np.tanh(rate / v0)) * np.exp(-0.5 * t)


def one_sided(delta, rate, t, k, c):
    return k * max(delta, 0.0) ** 3 + c * abs(rate) * rate


def one_sided_slopes(delta, rate, t, k, c):
    return 3.0 * k * max(delta, 0.0) ** 2, 2.0 * c * abs(rate)


SPRING = Spring(k=300.0, c=2.0)
LINEAR = CompiledLaw(force=linear, constants={"k": 300.0, "c": 2.0})
DAMPER = CompiledLaw(force=damper, constants={"c": 8.0, "cubic": -400.0, "k": 250.0, "v0": 0.3})
GIVEN = CompiledLaw(force=one_sided, slopes=one_sided_slopes, constants={"k": 2e3, "c": 1.5})


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_a_linear_law_is_a_spring(system):
    one, two = run_of(system, LINEAR), run_of(system, SPRING)
    np.testing.assert_allclose(one.position, two.position, rtol=0, atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("law", [DAMPER, GIVEN], ids=["complex step", "given slopes"])
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_gradients_by_densities_hold(system, law):
    check_gradients_by_densities(system, law)


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_slopes_by_constants_hold(system):
    seen, run = farthest(system), run_of(system, DAMPER)

    def of(name):
        return lambda value: system(DAMPER.changed(**{name: value}))

    chosen = {name: (value, of(name)) for name, value in DAMPER.constants.items()}
    by_name = parameter_slopes(run, seen, chosen)
    for name, value in DAMPER.constants.items():
        step = 1e-5 * abs(value)
        larger, smaller = (
            seen.value(simulate(of(name)(value + sign * step), DENSITY, 0.6, 300)) for sign in (1, -1)
        )
        assert by_name[name] == pytest.approx((larger - smaller) / (2 * step), rel=1e-6, abs=1e-10)
        if system is not natural:
            row = DAMPER.names.index(name)
            assert parameter_gradient(run, seen).law[row].sum() == pytest.approx(by_name[name], rel=1e-7)


@pytest.mark.parametrize("scheme", [RungeKutta8(), IndependentAlpha()], ids=lambda s: type(s).__name__)
def test_every_scheme_of_the_plane_runs_it(scheme):
    made = planar(DAMPER)
    usual, other = simulate(made, DENSITY, 0.4, 800), simulate(made, DENSITY, 0.4, 800, scheme=scheme)
    np.testing.assert_allclose(other.position[-1], usual.position[-1], rtol=0, atol=2e-6)
