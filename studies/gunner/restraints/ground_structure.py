"""The ground structure of Appendix C: 12 points of the torso x 15 of the vehicle for every kind of member.

Eight columns of five points stand on a circle about the hatch (Table C.1), four points ring each part of the
torso (Table C.2), and Table C.3 says who is tied to whom. All places are taken in the vehicle's frame of the
study: x forward, y left, z up, origin on the ground under the front axle. Table C.1 counts x rearward from
1.679 m behind that axle, y to the right, z from 0.77 m up; Table C.2 counts x up, y forward, z left from
0.268 m above the hip. Its slips (point 5 of C.1, points 1 to 3 of C.2) are corrected in the data.
"""

import csv
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

from workbench.engine import Airbag, Belt, Impulse, Retractor, SpatialMember

from ..figure import pieces
from ..figure_numbers import Numbers
from ..parameters import FILE, Number, read
from ..parts import Parts, Triple, triple

__all__ = ["FLOOR", "KINDS", "Kind", "Site", "laws", "restraints", "sites"]

Kind = Literal["belt", "airbag", "retractor"]
KINDS: tuple[Kind, ...] = ("belt", "airbag", "retractor")
FLOOR = 5  # layer of Table C.1, counted from the top

COLUMNS_ORIGIN = (-1.679, 0.0, 0.77)  # m: of Table C.1
TORSO_ORIGIN = 0.268  # m above the hip: of Table C.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """Where a member may sit: its row of Table C.3 and its two ends."""

    number: int
    gunner_point: int  # of Table C.2
    vehicle_point: int  # of Table C.1
    segment: str
    side: str
    layer: int  # 1 top .. 5 floor
    from_hip: Triple  # m, the gunner's end in the posture
    on_vehicle: Triple  # m, in the vehicle's frame


@cache
def sites() -> tuple[Site, ...]:
    """The 180 rows of Table C.3.

    >>> len(sites()), sum(site.layer == FLOOR for site in sites())
    (180, 36)
    """
    vehicle = {row["point"]: row for row in _table("vehicle_points.csv")}
    torso = {row["point"]: row for row in _table("occupant_points.csv")}
    found = []
    for row in _table("members.csv"):
        v, o = vehicle[row["vehicle_point"]], torso[row["gunner_point"]]
        back, right, high = (1e-3 * float(v[f"{axis}_use"]) for axis in "xyz")
        up, forward, left = (1e-3 * float(o[f"{axis}_use"]) for axis in "xyz")
        x, y, z = COLUMNS_ORIGIN
        found.append(Site(
            number=int(row["member"]), gunner_point=int(row["gunner_point"]),
            vehicle_point=int(row["vehicle_point"]), segment=o["segment"], side=o["side"],
            layer=int(row["layer_from_top"]), from_hip=(forward, left, TORSO_ORIGIN + up),
            on_vehicle=(x - back, y - right, z + high),
        ))  # fmt: skip
    return tuple(found)


def _table(name: str) -> tuple[dict[str, str], ...]:
    text = files("studies").joinpath("data", name).read_text(encoding="utf-8")
    return tuple(csv.DictReader(text.splitlines()))


@dataclass(frozen=True, slots=True, kw_only=True)
class _BeltNumbers:
    first_rate: Annotated[float, Number("N/m", positive=True)]
    second_rate: Annotated[float, Number("N/m", positive=True)]
    knee: Annotated[float, Number("m", positive=True)]
    width: Annotated[float, Number("m", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class _AirbagNumbers:
    force: Annotated[float, Number("N", positive=True)]
    length: Annotated[float, Number("m", positive=True)]
    exponent: Annotated[float, Number("1", positive=True)]
    onset: Annotated[float, Number("m", least=0.0)]
    cap: Annotated[float, Number("m", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class _RetractorNumbers:
    force: Annotated[float, Number("N", positive=True)]
    narrowness: Annotated[float, Number("1/s2", positive=True)]
    fires: Annotated[float, Number("s")]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Restraints:
    belt: _BeltNumbers
    airbag: _AirbagNumbers
    retractor: _RetractorNumbers


@cache
def laws(file: Path | str = FILE) -> dict[Kind, Belt | Airbag | Impulse]:
    """Laws (8.26) to (8.28) by kind, with the numbers of a file.

    Raises InvalidNumber for a number that is none, ValueError where a law refuses it.
    """
    given = read(_Restraints, "restraints", file)
    b, a, r = given.belt, given.airbag, given.retractor
    return {
        "belt": Belt(k1=b.first_rate, k2=b.second_rate, knee=b.knee, width=b.width),
        # c1 is left to the law: continuous at the onset, where (8.27) jumps by 2.9 N
        "airbag": Airbag(c0=a.force, length=a.length, power=a.exponent, onset=a.onset, cap=a.cap),
        "retractor": Retractor(f0=r.force, sigma=r.narrowness, t0=r.fires),
    }


def _from(point: Triple, origin: Triple) -> Triple:
    return point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]


def restraints(
    numbers: Numbers, kinds: tuple[Kind, ...] = ("belt",), *, file: Path | str = FILE, late: float = 0.0
) -> Parts:
    """The 180 members of each kind, kind by kind, between the torso and the body "vehicle".

    numbers: of the gunner, whose posture places his ends. late: s, by which retractors fire after their time,
    before it if negative. Raises ValueError for an unknown kind.
    """
    unknown = sorted(set(kinds) - set(KINDS))
    if unknown:
        raise ValueError(f"kinds needs names among {', '.join(KINDS)}, got {', '.join(unknown)}")
    law = dict(laws(file))
    at = {name: triple(piece.at) for name, piece in pieces(numbers).items()}
    retractor = law["retractor"]
    assert isinstance(retractor, Impulse)
    law["retractor"] = replace(retractor, t0=retractor.t0 + late)
    return Parts(
        members=tuple(
            SpatialMember(
                a=site.segment, b="vehicle",
                point_a=_from(site.from_hip, at[site.segment]),
                point_b=site.on_vehicle, law=law[kind], name=f"{kind} {site.number}",
            )
            for kind in kinds
            for site in sites()
        )
    )  # fmt: skip
