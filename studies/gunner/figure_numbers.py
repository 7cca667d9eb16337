"""The numbers of the gunner as `gunner.toml` gives them: segments, posture, joints, spine, grips, seat."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from math import radians
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from .parameters import FILE, Number, read
from .parts import Triple

__all__ = [
    "JOINTS", "POSTURES", "Figure", "Grips", "Joints", "Neck", "Numbers", "Posture", "Seat", "Segment",
    "Spine", "figure_numbers",
]  # fmt: skip

Pair = tuple[float, float]
POSTURES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {"seated": ("posture", "seat"), "standing": ("standing", "stance")}
)  # the tables of a posture: its angles, and what carries him


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A segment of the body; centre: share of its length from the proximal (trunk: the upper) end; inertia
    about the fore-aft, the left-right and the long axis when it stands upright.
    """

    mass: Annotated[float, Number("kg", positive=True)]
    length: Annotated[float, Number("m", positive=True)]
    centre: Annotated[float, Number("1", least=0.0)]
    inertia: Annotated[Triple, Number("kg m2", positive=True, count=3)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Neck:
    """How head and neck are parted; the mass centre and inertia of both together stay."""

    share: Annotated[float, Number("1", positive=True)]
    length: Annotated[float, Number("m", positive=True)]
    radius: Annotated[float, Number("m", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """Ten kinds of segments, limbs one of two."""

    head_and_neck: Segment
    upper_torso: Segment
    central_torso: Segment
    lower_torso: Segment
    upper_arm: Segment
    forearm: Segment
    hand: Segment
    thigh: Segment
    shank: Segment
    foot: Segment
    neck: Neck

    @property
    def mass(self) -> float:
        """Of the whole figure, kg."""
        trunk = ("head_and_neck", "upper_torso", "central_torso", "lower_torso")
        limbs = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
        return float(
            sum(getattr(self, name).mass for name in trunk)
            + 2.0 * sum(getattr(self, name).mass for name in limbs)
        )

    def of_mass(self, mass: float) -> "Figure":
        """The same lengths at another mass, kg; masses and inertias grow together."""
        if not mass > 0.0:
            raise ValueError(f"the gunner needs a mass > 0 kg, got {mass}")
        scale = mass / self.mass
        scaled: dict[str, Any] = {}
        for item in fields(self):
            segment = getattr(self, item.name)
            if isinstance(segment, Segment):
                x, y, z = (scale * i for i in segment.inertia)
                scaled[item.name] = replace(segment, mass=scale * segment.mass, inertia=(x, y, z))
        return replace(self, **scaled)


@dataclass(frozen=True, slots=True, kw_only=True)
class Posture:
    """Where the segments stand at the start; places in the vehicle's frame, angles in degrees."""

    hip: Annotated[Triple, Number("m", count=3)]
    shoulder_height: Annotated[float, Number("m", positive=True)]
    shoulder_half_width: Annotated[float, Number("m", positive=True)]
    hip_half_width: Annotated[float, Number("m", positive=True)]
    upper_arm: Annotated[float, Number("deg")]
    elbow: Annotated[float, Number("deg")]
    thigh: Annotated[float, Number("deg")]
    knee: Annotated[float, Number("deg")]

    def turns(self) -> dict[str, float]:
        """How far the joints TX are turned from a man who hangs straight, deg, in the sense of the stops."""
        return {
            "shoulder_tx": -self.upper_arm,
            "elbow": -self.elbow,
            "hip_tx": -self.thigh,
            "knee": self.knee,
            "ankle": self.thigh - self.knee,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Stiffness:
    """Table 8.6, one side; see `Joints.rates`."""

    shoulder_tx: Annotated[float, Number("N mm/rad", least=0.0)]
    shoulder_tz: Annotated[float, Number("N mm/rad", least=0.0)]
    elbow: Annotated[float, Number("N mm/rad", least=0.0)]
    wrist_tx: Annotated[float, Number("N mm/rad", least=0.0)]
    hip_tx: Annotated[float, Number("N mm/rad", least=0.0)]
    hip_tz: Annotated[float, Number("N mm/rad", least=0.0)]
    knee: Annotated[float, Number("N mm/rad", least=0.0)]
    ankle: Annotated[float, Number("N mm/rad", least=0.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stops:
    """Table 8.6: how far a joint turns back and forth from the posture."""

    shoulder_tx: Annotated[Pair, Number("rad", least=0.0, count=2)]
    shoulder_tz: Annotated[Pair, Number("rad", least=0.0, count=2)]
    elbow: Annotated[Pair, Number("rad", least=0.0, count=2)]
    wrist_tx: Annotated[Pair, Number("rad", least=0.0, count=2)]
    hip_tx: Annotated[Pair, Number("rad", least=0.0, count=2)]
    hip_tz: Annotated[Pair, Number("rad", least=0.0, count=2)]
    knee: Annotated[Pair, Number("rad", least=0.0, count=2)]
    ankle: Annotated[Pair, Number("rad", least=0.0, count=2)]


JOINTS = tuple(item.name for item in fields(Stiffness))  # x1 to x8 of Table 8.6


@dataclass(frozen=True, slots=True, kw_only=True)
class Joints:
    """The joints of the limbs."""

    damping: Annotated[float, Number("N m s/rad", least=0.0)]
    stop_rate: Annotated[float, Number("N m/rad", least=0.0)]
    stop_width: Annotated[float, Number("rad", positive=True)]
    least_stop: Annotated[float, Number("rad", positive=True)]
    stiffness: Stiffness
    stops: Stops

    def rate(self, joint: str, unit: str) -> float:
        """Stiffness in N m/rad, the table read in "N.mm/rad" or, as printed, in "N.m/rad"."""
        readings = {"N.mm/rad": 1e-3, "N.m/rad": 1.0}
        if unit not in readings:
            raise ValueError(f"joint_unit needs one of {', '.join(readings)}, got '{unit}'")
        return float(getattr(self.stiffness, joint)) * readings[unit]

    def stop(self, joint: str, turned: float = 0.0) -> Pair:
        """Stops back and forth, rad, none nearer than the least.

        turned: deg, how much further forth than seated the joint stands: its stops stay where they are.
        """
        back, forth = getattr(self.stops, joint)
        return max(back + radians(turned), self.least_stop), max(forth - radians(turned), self.least_stop)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spine:
    """Lumbar and thoracic joints, neck at C7 and below the head; three axes each."""

    torso_stiffness: Annotated[float, Number("N m/rad", least=0.0)]
    torso_damping: Annotated[float, Number("N m s/rad", least=0.0)]
    neck_stiffness: Annotated[float, Number("N m/rad", least=0.0)]
    neck_damping: Annotated[float, Number("N m s/rad", least=0.0)]
    flexion_stops: Annotated[Pair, Number("rad", positive=True, count=2)]
    other_stops: Annotated[Pair, Number("rad", positive=True, count=2)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Grips:
    """The hold of one hand on its handle."""

    stiffness: Annotated[float, Number("N/m", positive=True)]
    damping: Annotated[float, Number("N s/m", least=0.0)]
    slip: Annotated[float, Number("m", positive=True)]
    release: Annotated[float, Number("m", positive=True)]
    loss_time: Annotated[float, Number("s", positive=True)]
    loss_width: Annotated[float, Number("m", positive=True)]
    rounding: Annotated[float, Number("m", positive=True)]
    push: Annotated[float, Number("N", positive=True)]
    breakaway_factor: Annotated[float, Number("1", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Seat:
    """What carries him at level L0, hanging seat or floor under both feet; it lets go as a grip does."""

    stiffness: Annotated[float, Number("N/m", positive=True)]
    damping: Annotated[float, Number("N s/m", least=0.0)]
    cap: Annotated[float, Number("N", positive=True)]
    slip: Annotated[float, Number("m", positive=True)]
    release: Annotated[float, Number("m", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Numbers:
    """All numbers of the gunner in a posture; `seated` is the one from which the stops count."""

    figure: Figure
    posture: Posture
    seated: Posture
    joints: Joints
    spine: Spine
    grips: Grips
    seat: Seat


@cache
def figure_numbers(
    path: Path | str = FILE, figure: Path | str | None = None, posture: str = "seated"
) -> Numbers:
    """The tables [gunner. ...] of a file; `figure`: another file for [gunner.figure], as `hybrid3.toml`.

    posture: "seated", that of Table 8.1, or "standing".
    Raises InvalidNumber with the file, the key and what was expected, ValueError for another posture.

    >>> figure_numbers().figure.mass
    77.0
    """
    if posture not in POSTURES:
        raise ValueError(f"posture needs one of {', '.join(POSTURES)}, got '{posture}'")
    stands, carried = POSTURES[posture]
    return Numbers(
        figure=read(Figure, "gunner.figure", path if figure is None else figure),
        posture=read(Posture, f"gunner.{stands}", path),
        seated=read(Posture, "gunner.posture", path),
        joints=read(Joints, "gunner.joints", path),
        spine=read(Spine, "gunner.spine", path),
        grips=read(Grips, "gunner.grips", path),
        seat=read(Seat, f"gunner.{carried}", path),
    )
