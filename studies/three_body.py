"""Three planar bodies, two of them on a revolute joint, tied by 1,044 members: chapter VI of the
dissertation.

Coordinates are our own (the dissertation gives none); the joint makes it an index-3 differential-algebraic
system.
"""

import numpy as np

from workbench.engine import (
    Body,
    Deviation,
    GeneralisedAlpha,
    Load,
    Maximum,
    RevoluteJoint,
    Spring,
    System,
    dense_members,
)

from .two_body import Problem, rectangle_points

__all__ = ["problem"]


def problem() -> Problem:
    """Largest squared displacement of the mean centre of bodies 1 and 3 seen from body 2 over [0, 0.2] s.

    >>> len(problem().density)
    1044
    """
    bodies = (
        Body(name="1", mass=60.0, inertia=10.0, position=(0.3, 0.3, 0.0)),
        Body(name="2", mass=2000.0, inertia=6000.0, gravity=False),
        Body(name="3", mass=60.0, inertia=10.0, position=(0.3, 0.85, 0.0)),
    )
    on_2 = rectangle_points(36, 1.80, 2.40, (0.30, 0.60))
    law = Spring(k=83.3)  # "initial linear stiffness 8.33 N/m" at alpha = 0.1
    system = System(
        bodies=bodies,
        members=(
            *dense_members("1", "2", rectangle_points(17, 0.40, 0.60), on_2, law=law),
            *dense_members("3", "2", rectangle_points(12, 0.44, 0.50), on_2, law=law),
        ),
        joints=(RevoluteJoint(a="1", b="3", point_a=(0.0, 0.30), point_b=(0.0, -0.25)),),
        loads=(Load(body="2", torque=6000.0 * 9.42),),
    )
    return Problem(
        system=system, density=np.full(len(system.members), 0.1),
        objective=Maximum(quantity=Deviation(bodies=("1", "3"), reference="2", shares=(60.0, 60.0))),
        t_end=0.2, steps=200, scheme=GeneralisedAlpha(rho=0.8),
    )  # fmt: skip
