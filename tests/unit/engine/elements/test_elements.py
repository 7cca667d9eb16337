"""Force elements between bodies: one list for all kinds, their parameters, and what their states refuse."""

import numpy as np
import pytest

from workbench.engine import (
    Body,
    Bushing,
    Coordinate,
    GeneralisedAlpha,
    IndependentAlpha,
    InvalidSystem,
    JointSpring,
    Member,
    NotSupported,
    RevoluteJoint,
    RungeKutta8,
    Spring,
    System,
    Terminal,
    gradient,
    parameter_gradient,
    simulate,
)

SPRING = JointSpring(a="a", b="ground", k=5.0, c=0.1, k_stop=40.0, upper=0.02, lower=0.03)
ENDS = {"a": "a", "b": "ground", "point_a": (0.1, 0.0), "point_b": (0.198, 0.07)}
BUSHING = Bushing(**ENDS, k=800.0, c=2.0, cap=60.0)
BREAKS = Bushing(**ENDS, k=800.0, c=2.0, cap=60.0, slip=0.01, release=0.05)
BODY = Body(name="a", mass=1.0, inertia=0.1, position=(0.1, 0.05, 0.2), velocity=(2.0, 0.1, 1.0))
MEMBER = Member(a="a", b="ground", point_b=(0.0, 1.0), law=Spring(k=10.0, c=0.1))
END = Terminal(quantity=Coordinate(bodies=("a",)))


def system(**elements):
    return System(bodies=(BODY,), members=(MEMBER,), **elements)


def run(tied, scheme=None):
    return simulate(tied, [1.0], 0.1, 60, scheme=scheme)


def test_elements_of_any_kind_act_as_in_the_fields_of_their_own():
    fields = run(system(springs=(SPRING,), bushings=(BREAKS,)))
    listed = run(system(elements=(SPRING, BREAKS)))
    assert np.ptp(fields.damage) > 0.1
    np.testing.assert_array_equal(listed.position, fields.position)
    np.testing.assert_array_equal(listed.states, fields.states)
    np.testing.assert_array_equal(listed.mechanical_energy(), fields.mechanical_energy())
    assert listed.damage.shape == (61, 0)  # of `System.bushings`
    there, here = parameter_gradient(fields, END), parameter_gradient(listed, END)
    np.testing.assert_array_equal(here.element[0], there.spring[:, 0])
    np.testing.assert_array_equal(here.element[1], there.bushing[:, 0])
    assert there.element == ()
    assert np.abs(there.spring[0]).min() > 0.0
    assert np.abs(there.bushing).min() > 0.0


def test_the_order_of_elements_with_and_without_states_is_free():
    mixed = run(system(elements=(BREAKS, SPRING, BUSHING)))
    fields = run(system(springs=(SPRING,), bushings=(BREAKS, BUSHING)))
    np.testing.assert_allclose(mixed.position, fields.position, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(
        gradient(mixed.system, [1.0], mixed, END), gradient(fields.system, [1.0], fields, END), rtol=1e-10
    )


def test_an_element_at_a_stranger_is_refused():
    with pytest.raises(InvalidSystem, match=r"elements\[0\] refers to body 'x', which the system does not"):
        system(elements=(JointSpring(a="a", b="x"),))


def test_states_are_carried_by_generalised_alpha_alone():
    with pytest.raises(
        NotSupported, match="explicit Runge-Kutta does not carry the states of force elements"
    ):
        run(system(elements=(BREAKS,)), RungeKutta8())
    held = run(system(elements=(BREAKS,)), GeneralisedAlpha())
    with pytest.raises(
        NotSupported, match="direct differentiation does not carry the states of force elements"
    ):
        gradient(held.system, [1.0], held, END, method="direct")
    pin = RevoluteJoint(a="a", b="ground", point_b=(0.1, 0.05))
    still = Body(name="a", mass=1.0, inertia=0.1, position=(0.1, 0.05, 0.2))
    pinned = System(bodies=(still,), members=(MEMBER,), joints=(pin,), elements=(BREAKS,))
    with pytest.raises(NotSupported, match="with joints does not carry the states of force elements"):
        run(pinned, IndependentAlpha())
