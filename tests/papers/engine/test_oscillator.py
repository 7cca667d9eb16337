"""The oscillator of sections 5.4.1 and 6.3.1 against its closed form, and the reverse method of section
2.3."""

import numpy as np
import pytest

from studies import oscillator, two_body
from tests.papers.engine.reverse_compatibility import reverse_compatibility
from workbench.engine import RungeKutta8, gradient, parameter_gradient, simulate


@pytest.mark.parametrize("mass", [1.0, 2.5])
def test_position_and_gradient_against_the_closed_form(mass):
    # (5.21) holds for m = 1 only; ours for any mass
    p = oscillator.problem(mass=mass)
    x, slope = oscillator.closed_form(p, p.t_end)
    run = simulate(p.system, p.density, p.t_end, 100, scheme=RungeKutta8())
    assert run.position[-1, 0] == pytest.approx(x, rel=1e-10)
    assert gradient(p.system, p.density, run, p.objective)[0] == pytest.approx(slope, rel=1e-10)


def test_slope_by_mass():
    p = oscillator.problem(mass=2.0)
    values = []
    for steps in (1000, 2000):
        run = simulate(p.system, p.density, p.t_end, steps)
        values.append(parameter_gradient(run, p.objective).mass[0])
    # dx/dm = -(k/m) dx/dk of the spring's position law: x depends on k/m and v0 only
    _, by_alpha = oscillator.closed_form(p, p.t_end)
    assert (4 * values[1] - values[0]) / 3 == pytest.approx(-by_alpha / p.mass, rel=1e-6)


def test_errors_of_all_methods_fall_with_the_step():
    ds = oscillator.run()
    error = ds.relative_error.sel(steps=1000) / ds.relative_error.sel(steps=500)
    for method in ds.sensitivity.values:
        order = -np.log2(float(error.sel(sensitivity=method)))
        expected = 1.0 if method in ("iterative_printed", "iterative_truncated") else 2.0
        assert order == pytest.approx(expected, abs=0.25), method
    assert float(ds.relative_error.sel(sensitivity="discrete_adjoint", steps=1000)) < 1e-3


def test_the_reverse_method_does_not_converge():
    p = two_body.problem("C")
    found = []
    for steps in (200, 2000):
        run = simulate(p.system, p.density, p.t_end, steps)
        found.append(reverse_compatibility(run, "1", node=steps // 2))
    assert min(f.relative_error for f in found) > 0.5
    assert found[1].condition > 30 * found[0].condition
    with pytest.raises(ValueError, match="needs three nodes after node 199"):
        reverse_compatibility(simulate(p.system, p.density, 0.2, 200), "1", node=199)
