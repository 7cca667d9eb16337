"""The gunner to look at: his segments as capsules, the vehicle with its wheels, the hatch and the bars.

The outside of the vehicle is that of `[vehicle.shell]`, the inside that of `[gunner.cabin]`, the thickness
of the segments that of `[gunner.skin]` in `gunner.toml`, all of them assumed there. Wheels have few sides, so
that one sees them turn. What is not flat of the ground is drawn by `road`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from workbench.engine import Deviation, RelativeSpeed, TreeTrajectory
from workbench.motion.frames import Body, History, Motion
from workbench.motion.meshes import Mesh, cylinder, prism, ring
from workbench.motion.trajectories import Drawn, frames

from ..cabin.contacts import CabinNumbers, balls, cabin_numbers
from ..cases import Case, numbers_of, vehicle_numbers
from ..figure import FIGURE, pieces
from ..figure_numbers import Numbers
from ..manoeuvre import Ground
from ..occupant_responses import shares_of
from ..parts import triple
from ..proving_grounds import ProvingGround
from ..vehicle.numbers import VehicleParameters
from .road import depth, ground_drawn

__all__ = ["drawn", "motion_of"]

FRAMES = 101
SILL = 0.45  # m, where the drawn hull ends below
WHEEL_WIDTH, WHEEL_SIDES = 0.32, 10
SEAT = (0.36, 0.40, 0.08)  # m, edges
BAR = (0.018, 0.16)  # m, radius and length of what a hand holds
HEAD = 0.06  # m, between the centres of the caps of the head
PALM = 0.035  # m, radius of a hand


def motion_of(runs: Mapping[str, TreeTrajectory], case: Case, *, title: str) -> Motion:
    """Runs of one case side by side, with the deviation of his mass centre and the speed of his head."""
    first = next(iter(runs.values()))
    ground = case.on.ground if isinstance(case.on, ProvingGround) else Ground()
    shapes = (*drawn(first, case), *ground_drawn(ground, tuple(runs.values())))
    centre = {body.name: body.centre for body in first.system.bodies}
    head = RelativeSpeed(body="head", point=centre["head"], reference="vehicle")
    deviation = Deviation(
        bodies=FIGURE, shares=shares_of(first.system), reference="vehicle", weights=(1.0, 1.0, 1.0)
    )
    seen = {label: frames(run, label=label, count=FRAMES, drawn=shapes) for label, run in runs.items()}
    lifted = np.array([0.0, 0.0, depth(ground.road), 0.0, 0.0, 0.0, 0.0])
    fixed = np.array([shape.on == "ground" for shape in shapes])[:, None]
    times = next(iter(seen.values()))[0]
    nodes = np.searchsorted(first.times, times)
    reach = {label: np.sqrt(deviation.values(run))[nodes] for label, run in runs.items()}
    speed = {label: np.asarray(head.values(run))[nodes] for label, run in runs.items()}
    peak = max(float(times[values.argmax()]) for values in reach.values())
    last = float(times[-1])
    return Motion(
        title=title,
        times=times,
        runs=tuple(replace(run, poses=run.poses + np.where(fixed, 0.0, lifted)) for _, run in seen.values()),
        histories=(
            History(name="deviation of his mass centre", unit="m", series=reach),
            History(name="speed of his head beside the vehicle", unit="m/s", series=speed),
        ),
        storyboard=tuple(sorted({0.0, 0.5 * last, peak, last})),
    )


def drawn(run: TreeTrajectory, case: Case) -> Iterator[Drawn]:
    """The shapes of the bodies that the run has."""
    numbers, inside = numbers_of(case), cabin_numbers(case.file)
    yield from _vehicle(run, vehicle_numbers(case.file), inside, numbers)
    yield from _figure(numbers, inside)


def _mesh(name: str, role: str, mesh: Mesh, *, see_through: bool = False) -> Body:
    vertices, triangles = mesh
    return Body(
        name=name, shape="mesh", role=role, see_through=see_through, vertices=vertices, triangles=triangles
    )


def _vehicle(
    run: TreeTrajectory, vehicle: VehicleParameters, inside: CabinNumbers, numbers: Numbers
) -> Iterator[Drawn]:
    shell, cabin = vehicle.shell, inside.cabin
    front, rear, half, bumper = shell.bumper
    nose, _, _, bonnet = shell.bonnet
    ahead, behind, _, belt = shell.belt
    over, under, narrow, roof = shell.roof
    hull = [(rear, SILL), (front, SILL), (front, bumper), (nose, bonnet), (rear, belt)]
    top = [(behind, belt), (ahead, belt), (over, roof), (under, roof)]
    yield Drawn(shape=_mesh("hull", "vehicle", prism(hull, 2.0 * half), see_through=True), on="vehicle")
    yield Drawn(shape=_mesh("cab", "vehicle", prism(top, 2.0 * narrow), see_through=True), on="vehicle")
    hatch = _mesh("hatch ring", "vehicle", ring(cabin.ring_radius, 2.0 * cabin.ring_tube))
    yield Drawn(shape=hatch, on="vehicle", at=cabin.hatch)
    hip = np.asarray(numbers.posture.hip)
    seat = Body(name="seat", shape="box", size=SEAT, role="seat")
    yield Drawn(shape=seat, on="vehicle", at=triple(hip - (0.0, 0.0, inside.skin.trunk + 0.5 * SEAT[2])))
    across = float(np.sqrt(0.5))  # a quarter turn about x lays a bar along y
    for side in ("left", "right"):
        hand = pieces(numbers)[f"{side} hand"]
        bar = Body(name=f"{side} bar", shape="capsule", size=BAR, role="seat")
        yield Drawn(
            shape=bar, on="vehicle", at=triple(hip + hand.at + hand.centre), turn=(across, across, 0.0, 0.0)
        )
    wheel = cylinder(vehicle.tyre.radius, WHEEL_WIDTH, sides=WHEEL_SIDES)
    for body in run.system.bodies:
        if body.name.endswith(" wheel"):
            yield Drawn(shape=_mesh(body.name, "wheel", wheel), on=body.name)


def _figure(numbers: Numbers, inside: CabinNumbers) -> Iterator[Drawn]:
    body, skin = pieces(numbers), inside.skin
    far = {piece.parent: piece.at - body[piece.parent].at for piece in body.values() if piece.parent}
    for side in ("left", "right"):  # the torso carries more than one; arms and legs have one each
        far |= {f"{side} thigh": body[f"{side} shank"].at - body[f"{side} thigh"].at}
        far |= {f"{side} foot": np.array([numbers.figure.foot.length, 0.0, 0.0])}
    far |= {
        "lower torso": body["central torso"].at - body["lower torso"].at,
        "central torso": body["upper torso"].at - body["central torso"].at,
        "upper torso": body["neck"].at - body["upper torso"].at,
    }
    thick = {ball.body: ball.radius for ball in balls(numbers, skin)}
    for name in FIGURE:
        role = "head" if name == "head" else "occupant"
        if name == "head":
            shape = Body(name=name, shape="capsule", size=(skin.head, HEAD), role=role)
            yield Drawn(shape=shape, on=name, at=triple(body[name].centre))
            continue
        if name.endswith("hand"):
            shape = Body(name=name, shape="capsule", size=(PALM, 0.05), role=role)
            yield Drawn(shape=shape, on=name, at=triple(body[name].centre))
            continue
        radius = numbers.figure.neck.radius if name == "neck" else thick[name]
        reach = far[name]
        length = float(np.linalg.norm(reach))
        shape = Body(name=name, shape="capsule", size=(radius, max(length - radius, 0.0)), role=role)
        lower = skin.foot - skin.sole if name.endswith("foot") else 0.0
        at = triple(0.5 * reach + (0.0, 0.0, lower))
        yield Drawn(shape=shape, on=name, at=at, turn=_onto(reach / length))


def _onto(axis: np.ndarray) -> tuple[float, float, float, float]:
    """The shortest turn of z onto a unit axis, w, x, y, z."""
    x, y, z = (float(e) for e in axis)
    if z < -1.0 + 1e-9:
        return 0.0, 1.0, 0.0, 0.0
    w = float(np.sqrt(0.5 * (1.0 + z)))
    return w, -y / (2.0 * w), x / (2.0 * w), 0.0
