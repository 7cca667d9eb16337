"""Balances of a run: what was stored and taken out, beside what the road did, over the whole system."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.special import spence

from workbench.engine import CoordinateSpring, TreeTrajectory

__all__ = ["Energies", "angular_momentum", "energies", "momentum_gap"]

Array = np.ndarray[Any, Any]
GROUND = "ground"


@dataclass(frozen=True, slots=True, kw_only=True)
class Energies:
    """Histories of energies since the start, (steps + 1,) J each.

    kinetic, gravity, springs: stored.  dampers, brakes: taken out on the joints.  tyres, contacts: work of
    the road on the wheels and of contacts on both their bodies, vertical springs of the tyres included.
    holds: work of bushings on both their bodies.
    """

    kinetic: Array
    gravity: Array
    springs: Array
    dampers: Array
    brakes: Array
    tyres: Array
    contacts: Array
    holds: Array

    @property
    def gap(self) -> Array:
        """What is missing in the sum; the work of the driver at the steering wheel is not counted."""
        stored = self.kinetic + self.gravity + self.springs
        return np.asarray(stored + self.dampers + self.brakes - self.tyres - self.contacts - self.holds)


def energies(run: TreeTrajectory) -> Energies:
    """The energies of a run: coordinate springs, dampers, couplings, tyres, contacts and bushings."""
    system, time = run.system, run.times

    def since(x: Array) -> Array:
        return np.asarray(x - x[0])

    def work(power: Array) -> Array:
        return np.asarray(cumulative_simpson(power, x=time, initial=0.0))

    def q(body: str, i: int) -> Array:
        return run.position[:, run.parts.coordinates[body].start + i]

    def speed(body: str, i: int) -> Array:
        return run.velocity[:, run.columns(body)][:, i]

    stored = np.zeros(len(time))
    lost = {"dampers": np.zeros(len(time)), "brakes": np.zeros(len(time))}
    for spring in system.springs:
        stored += _energy(spring, q(spring.body, spring.coordinate))
        lost["dampers"] += spring.c * speed(spring.body, spring.coordinate) ** 2
    for bar in system.couplings:
        apart = q(bar.a, bar.coordinate_a) - q(bar.b, bar.coordinate_b)
        stored += 0.5 * bar.k * (apart - (apart[0] if bar.rest is None else bar.rest)) ** 2
        lost["dampers"] += bar.c * (speed(bar.a, bar.coordinate_a) - speed(bar.b, bar.coordinate_b)) ** 2
    for damper in system.dampers:
        rate = speed(damper.body, damper.coordinate)
        mean, half, slow = damper.numbers()
        s = np.sqrt(rate * rate + slow * slow)
        friction = np.array([damper.friction_at(float(t)) for t in time])
        lost["dampers"] += (mean * rate + half * (s - slow)) * rate
        lost["brakes"] += friction * rate * rate / s
    tyres = [(tyre.body, GROUND) for tyre in system.tyres]
    contacts = [(contact.a, contact.b) for contact in system.contacts]
    return Energies(
        kinetic=since(run.kinetic_energy()), gravity=since(run.gravity_energy()), springs=since(stored),
        dampers=work(lost["dampers"]), brakes=work(lost["brakes"]),
        tyres=work(_power(run, tyres, *run.tyre_forces())),
        contacts=work(_power(run, contacts, *run.contact_forces())), holds=work(_held(run)),
    )  # fmt: skip


def _energy(spring: CoordinateSpring, q: Array) -> Array:
    """Stored in a spring with its stops and constant torque."""
    phi = q - (q[0] if spring.rest is None else spring.rest)
    stop = _softplus_integral(phi - spring.upper, spring.width)
    stop = stop + _softplus_integral(-phi - spring.lower, spring.width)
    return np.asarray(0.5 * spring.k * phi * phi + spring.k_stop * stop - spring.torque * phi)


def _softplus_integral(x: Array, width: float) -> Array:
    """Integral of width log(1 + exp(x/width)) from minus infinity: -width^2 Li2(-exp(x/width))."""
    return np.asarray(-(width**2) * spence(1.0 + np.exp(x / width)))


def _power(run: TreeTrajectory, bodies: list[tuple[str, str]], force: Array, point: Array) -> Array:
    """Of forces on the first bodies, and their reactions on the second, at common points."""
    total = np.zeros(len(run.times))
    frames = {name: run.frames(name) for name in {name for pair in bodies for name in pair} - {GROUND}}
    for i, (a, b) in enumerate(bodies):
        if not force[:, i].any():
            continue
        speed = _speed(frames[a], point[:, i])
        if b != GROUND:
            speed = speed - _speed(frames[b], point[:, i])
        total += np.einsum("ti,ti->t", force[:, i], speed)
    return total


def _speed(frames: Any, point: Array) -> Array:
    return np.asarray(frames.velocity + np.cross(frames.spin, point - frames.origin))


def _held(run: TreeTrajectory) -> Array:
    """Power of the bushings; their reactions on `b` act at the point of `a`."""
    total = np.zeros(len(run.times))
    for bushing in run.system.bushings:
        axes = np.eye(3)[None] if bushing.b == GROUND else run.frames(bushing.b).axes
        force = np.einsum("tij,tj->ti", axes, run.bushing_force(bushing.name))
        point = run.of(bushing.a, bushing.point_a)
        total += _power(run, [(bushing.a, bushing.b)], force[:, None], point[:, None])
    return total


def momentum_gap(run: TreeTrajectory) -> Array:
    """(steps + 1, 3) momentum gained less the impulses of weight, tyres and contacts with the ground, N s."""
    momentum = run.momentum()[:, 3:]
    outer = [contact.b == GROUND for contact in run.system.contacts]
    force = run.tyre_forces().force.sum(axis=1) + run.contact_forces().force[:, outer].sum(axis=1)
    force = force + sum(body.mass for body in run.system.bodies) * np.asarray(run.system.gravity)
    impulse = cumulative_simpson(force, x=run.times, axis=0, initial=0.0)
    return np.asarray(momentum - momentum[0] - impulse)


def angular_momentum(run: TreeTrajectory) -> Array:
    """(steps + 1, 3) about the common mass centre, N m s."""
    bodies = run.system.bodies
    mass = sum(body.mass for body in bodies)
    centre = sum(body.mass * run.of(body.name, body.centre) for body in bodies) / mass
    both = run.momentum()
    return np.asarray(both[:, :3] - np.cross(centre, both[:, 3:]))
