"""The occupant's body: ten segments in the reference posture, and the joints between them.

Segments after de Leva 1996 scaled to 77 kg and 1.778 m, paired limbs lumped; joint stiffness Table 8.6 in
N mm/rad (printed as N m/rad, see docs/departures.md), both sides together; spine and neck stiffness and the
stops are assumed. Frame and signs: `studies/occupant.py`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

__all__ = ["CG", "HIP", "JOINTS", "MASSES", "OCCUPANT_MASS", "SEGMENTS", "SIDES", "Joint"]

OCCUPANT_MASS = 77.0  # kg, of the segment table
HIP = (0.2760, 0.8650)

# name: (mass kg, mass centre x, y in m, inertia about the mass centre kg m2)
SEGMENTS = {
    "head": (5.344, 0.2760, 1.6051, 0.0326),
    "upper torso": (12.289, 0.2760, 1.3558, 0.0769),
    "central torso": (12.574, 0.2760, 1.1348, 0.0893),
    "lower torso": (8.601, 0.2760, 0.9228, 0.0578),
    "upper arms": (4.174, 0.1293, 1.3030, 0.0250),
    "forearms": (2.494, -0.1027, 1.2612, 0.0132),
    "hands": (0.940, -0.3196, 1.2879, 0.0019),
    "thighs": (21.806, 0.1511, 0.7401, 0.4388),
    "shanks": (6.668, -0.0289, 0.3625, 0.0812),
    "feet": (2.110, -0.0889, 0.0769, 0.0088),
}
MASSES = tuple(mass for mass, *_ in SEGMENTS.values())
CG = tuple(
    sum(s[0] * s[axis] for s in SEGMENTS.values()) / sum(MASSES) for axis in (1, 2)
)  # of the whole body, reference posture


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """A revolute joint of distal segment `a` on proximal segment `b`, with spring, damper and soft stops.

    stiffness N m/rad and damping N m s/rad for both sides together; `up` and `down` are the stops (rad) on
    the counter-clockwise and the clockwise side of the reference posture.
    """

    a: str
    b: str
    at: tuple[float, float]
    stiffness: float
    damping: float
    up: float
    down: float
    stop: float = 2000.0


SIDES = 2
JOINT_DAMPING = SIDES * 0.65192  # N m s/rad, the 651.92 N mm s/rad of section 8.4
# name: the joint; those of Table 8.6 carry its name and get their stiffness from the table
JOINTS: Mapping[str, Joint] = MappingProxyType(
    {
        "lumbar": Joint(
            a="central torso",
            b="lower torso",
            at=(0.2760, 1.0138),
            stiffness=300.0,
            damping=10.0,
            up=0.8,
            down=0.8,
        ),
        "thoracic": Joint(
            a="upper torso",
            b="central torso",
            at=(0.2760, 1.2339),
            stiffness=300.0,
            damping=10.0,
            up=0.8,
            down=0.8,
        ),
        "neck": Joint(
            a="head",
            b="upper torso",
            at=(0.2760, 1.4811),
            stiffness=30.0,
            damping=1.5,
            up=1.0,
            down=1.0,
            stop=500.0,
        ),
        "shoulder TX": Joint(
            a="upper arms",
            b="upper torso",
            at=(0.2760, 1.3810),
            stiffness=25.4778,
            damping=JOINT_DAMPING,
            up=1.083,
            down=0.785,
        ),
        "elbow": Joint(
            a="forearms",
            b="upper arms",
            at=(0.0220, 1.2459),
            stiffness=60.0,
            damping=JOINT_DAMPING,
            up=0.523,
            down=1.657,
        ),
        "wrist TX": Joint(
            a="hands",
            b="forearms",
            at=(-0.2506, 1.2794),
            stiffness=40.0,
            damping=JOINT_DAMPING,
            up=0.523,
            down=1.378,
        ),
        "hip TX": Joint(
            a="thighs", b="lower torso", at=HIP, stiffness=120.0, damping=JOINT_DAMPING, up=0.872, down=0.488
        ),
        "knee": Joint(
            a="shanks",
            b="thighs",
            at=(-0.0289, 0.5601),
            stiffness=800.0,
            damping=JOINT_DAMPING,
            up=1.483,
            down=0.872,
        ),
        "ankle": Joint(
            a="feet",
            b="shanks",
            at=(-0.0289, 0.1169),
            stiffness=600.0,
            damping=JOINT_DAMPING,
            up=0.872,
            down=0.349,
        ),
    }
)
