"""What the vehicle does in a run: angles, accelerations, wheel loads, and numbers made of them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.engine import TreeTrajectory

from ..parts import GRAVITY

__all__ = ["VehicleStates", "first_time", "vehicle_responses", "vehicle_states"]

Array = np.ndarray[Any, Any]
LIFTED = 1.0  # N: a wheel with less has left the ground
TIPPED = np.radians(45.0)  # further than any vehicle comes back from


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleStates:
    """Histories of the body "vehicle", (steps + 1,) each.

    roll, pitch, yaw: rad, positive to the right, nose down, to the left (about x, y, z of the vehicle, turned
    yaw first).  yaw_rate: rad/s.  heave: m, rise of the mass centre of the sprung body.
    speed, drift: m/s of that centre along the level heading and to the left of it.
    forward, lateral: m/s^2, its level accelerations.  place: (steps + 1, 3) m.
    wheel_loads: (steps + 1, 4) N, in the order front left, front right, rear left, rear right.
    """

    time: Array
    roll: Array
    pitch: Array
    yaw: Array
    yaw_rate: Array
    heave: Array
    speed: Array
    drift: Array
    forward: Array
    lateral: Array
    place: Array
    wheel_loads: Array


def vehicle_states(run: TreeTrajectory) -> VehicleStates:
    """The histories of a run of a system that holds the vehicle."""
    frames = run.frames("vehicle")
    body = next(body for body in run.system.bodies if body.name == "vehicle")
    axes, arm = frames.axes, frames.axes @ np.asarray(body.centre)
    place = frames.origin + arm
    velocity = frames.velocity + np.cross(frames.spin, arm)
    push = frames.acceleration + np.cross(frames.spin_rate, arm)
    push = push + np.cross(frames.spin, np.cross(frames.spin, arm))
    yaw = np.unwrap(np.arctan2(axes[:, 1, 0], axes[:, 0, 0]))
    ahead = np.stack([np.cos(yaw), np.sin(yaw), np.zeros(len(yaw))], axis=1)
    aside = np.stack([-np.sin(yaw), np.cos(yaw), np.zeros(len(yaw))], axis=1)
    return VehicleStates(
        time=run.times, yaw=yaw, yaw_rate=frames.spin[:, 2],
        pitch=-np.arcsin(np.clip(axes[:, 2, 0], -1.0, 1.0)),
        roll=np.unwrap(np.arctan2(axes[:, 2, 1], axes[:, 2, 2])),
        heave=place[:, 2] - place[0, 2], place=place,
        speed=np.einsum("ti,ti->t", velocity, ahead), drift=np.einsum("ti,ti->t", velocity, aside),
        forward=np.einsum("ti,ti->t", push, ahead), lateral=np.einsum("ti,ti->t", push, aside),
        wheel_loads=run.tyre_forces().force[:, :, 2],
    )  # fmt: skip


def first_time(time: Array, history: Array, level: float) -> float:
    """When a history first reaches a level, between nodes by a straight line; inf where it never does.

    >>> first_time(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 3.0]), 2.0)
    1.5
    """
    beyond = np.flatnonzero(history >= level)
    if not len(beyond):
        return float("inf")
    i = int(beyond[0])
    if i == 0:
        return float(time[0])
    share = (level - history[i - 1]) / (history[i] - history[i - 1])
    return float(time[i - 1] + share * (time[i] - time[i - 1]))


def vehicle_responses(states: VehicleStates) -> dict[str, float]:
    """Numbers of a run: extremes, the time of tipping over (inf: never) and of the first wheel lift."""
    s = states
    return {
        "peak lateral acceleration": float(np.abs(s.lateral).max() / GRAVITY),
        "peak roll": float(np.degrees(np.abs(s.roll).max())),
        "peak pitch": float(np.degrees(np.abs(s.pitch).max())),
        "peak yaw rate": float(np.degrees(np.abs(s.yaw_rate).max())),
        "heave peak to peak": float(np.ptp(s.heave)),
        "least wheel load": float(s.wheel_loads.min()),
        "first wheel lift": first_time(s.time, -s.wheel_loads.min(axis=1), -LIFTED),
        "tipped over": first_time(s.time, np.abs(s.roll), float(TIPPED)),
        "final speed": float(s.speed[-1]),
    }
