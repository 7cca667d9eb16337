"""Slopes of objectives of trees by parameters of every kind, against differences of whole runs."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from tests.sample_trees import random_tree, tree_run
from workbench.engine import (
    Coordinate,
    Deviation,
    Maximum,
    Planar,
    Prescribed,
    Prismatic,
    Revolute,
    SpatialBody,
    SpatialLoad,
    SpatialMotion,
    Terminal,
    TreeSystem,
    Welded,
    parameter_gradient,
    parameter_slopes,
)
from workbench.engine.integration.schemes import GeneralisedAlpha, RungeKutta8

pytestmark = pytest.mark.slow

DIFFERENCES = 1e-7  # of a slope, or of what a change of 1 % does to the objective
CLOSED = 1e-9  # the tables of `parameter_slopes` come by differences
ROUNDING = 1e-11  # of an objective, divided by the step of the differences
SCHEME = GeneralisedAlpha(tolerance=1e-15)
TIMES = np.linspace(0.0, 0.03, 11)
SKIPPED = {"a", "b", "body", "parent", "name", "follows", "coordinate", "coordinate_a", "coordinate_b"}


def changed(record, name, value):
    """A record with one number changed; `name` may go into tuples and records: 'shape.offset', 'point.1'."""
    head, _, rest = name.partition(".")
    old = record[int(head)] if isinstance(record, tuple) else getattr(record, head)
    new = changed(old, rest, value) if rest else value
    if isinstance(record, tuple):
        return (*record[: int(head)], new, *record[int(head) + 1 :])
    return replace(record, **{head: new})


def numbers(record):
    """Names and values of all numbers in a record."""
    items = (
        enumerate(record)
        if isinstance(record, tuple)
        else ((f.name, getattr(record, f.name)) for f in fields(record))
    )
    for name, value in items:
        if name in SKIPPED or isinstance(value, bool) or value is None or isinstance(value, str):
            continue
        if isinstance(value, float | np.floating):
            yield str(name), float(value)
        elif isinstance(value, tuple) or is_dataclass(value):
            yield from ((f"{name}.{rest}", x) for rest, x in numbers(value))


def every_number(system):
    """(name, value, system at a value) of all elements, joints and places of a system."""
    for part in fields(system):
        if part.name in ("gravity",):
            continue
        for index, record in enumerate(getattr(system, part.name)):
            for name, value in numbers(record):

                def at(x, part=part.name, index=index, name=name):
                    records = list(getattr(system, part))
                    records[index] = changed(records[index], name, x)
                    return replace(system, **{part: tuple(records)})

                yield f"{part.name}[{index}].{name}", value, at
    for e in range(3):
        yield f"gravity.{e}", system.gravity[e], lambda x, e=e: changed(system, f"gravity.{e}", x)


def along(f, step):
    """Derivative at 0 by central differences of fourth order."""
    return (8.0 * (f(step) - f(-step)) - (f(2 * step) - f(-2 * step))) / (12.0 * step)


def compare(system, run, objective, scheme, chosen):
    """Largest error of the slopes by the chosen parameters."""
    density = run.density
    found = parameter_slopes(run, objective, {name: (value, at) for name, value, at in chosen})
    size = abs(objective.value(run))
    for name, value, at in chosen:
        step = 3e-4 * (abs(value) or 1.0)
        expected = along(
            lambda e, at=at, value=value: objective.value(tree_run(at(value + e), density, TIMES, scheme)),
            step,
        )
        scale = max(abs(expected), size / (100.0 * (abs(value) or 1.0)))
        assert abs(found[name] - expected) < DIFFERENCES * scale + ROUNDING * size / step, name


def far(system):
    """Deviation of the last bodies seen from the second: it refers to the start, places and centres."""
    names = [body.name for body in system.bodies]
    return Terminal(
        quantity=Deviation(
            bodies=tuple(names[-2:]), reference=names[1], shares=(1.0, 2.0), weights=(1.0, 2.0, 3.0)
        )
    )


def _planar(system, name):
    return isinstance(system.bodies[int(name[name.index("[") + 1 : name.index("]")])].joint, Planar)


@pytest.mark.parametrize("seed", range(6))
def test_slopes_by_every_kind_of_number_are_those_of_differences(seed):
    rng = np.random.default_rng(300 + seed)
    system = random_tree(rng, count=4 + seed % 3, first=seed % 7)
    scheme = RungeKutta8() if seed == 5 else SCHEME
    run = tree_run(system, rng.uniform(0.5, 1.0, 12), TIMES, scheme)
    known = list(every_number(system))
    # a plane's axes stay perpendicular
    known = [k for k in known if not ("joint.axes" in k[0] and _planar(system, k[0]))]
    some = rng.choice(len(known), 40, replace=False)
    compare(system, run, far(system), scheme, [known[i] for i in some])


@pytest.mark.parametrize("seed", range(8))
def test_the_closed_record_says_what_slopes_by_name_say(seed):
    """Laws, points, bushings, springs of `parameter_gradient` on random trees; nothing is not a number."""
    rng = np.random.default_rng(6000 + seed)
    system = random_tree(rng, count=4 + seed % 4, first=seed % 7)
    run = tree_run(system, rng.uniform(0.3, 1.0, 12), TIMES, RungeKutta8() if seed % 4 == 3 else SCHEME)
    objective = far(system)
    record = parameter_gradient(run, objective)
    assert all(np.isfinite(getattr(record, part.name)).all() for part in fields(record))
    i, u = int(rng.integers(12)), int(rng.integers(4))
    closed = {
        f"members[{i}].law.{name}": record.law[j, i] for j, name in enumerate(system.members[i].law.names)
    }
    for e in range(3):
        closed[f"members[{i}].point_a.{e}"] = record.point_a[i, e]
        closed[f"bushings[{u}].k.{e}"] = record.bushing[e, u]
        closed[f"bushings[{u}].preload.{e}"] = record.bushing[12 + e, u]
    if system.springs:
        closed |= {f"springs[0].{name}": record.spring[j, 0] for j, name in enumerate(("k", "c"))}
    known = {name: (value, at) for name, value, at in every_number(system) if name in closed}
    by_name, size = parameter_slopes(run, objective, known), abs(objective.value(run))
    assert len(known) > 8
    for name, (value, _) in known.items():
        scale = max(abs(by_name[name]), size / (100.0 * (abs(value) or 1.0)))
        assert abs(closed[name] - by_name[name]) < CLOSED * scale, name


def driven(rng):
    """A tree on a carrier that is driven through space, pushed over time; by the size of both."""
    tree = random_tree(rng, count=5, first=3)

    def at(size):
        motion = SpatialMotion(
            position=lambda t: (size * np.sin(3.0 * t), 0.1 * t, 0.0),
            rotation=lambda t: np.array(
                [
                    [np.cos(size * t), -np.sin(size * t), 0.0],
                    [np.sin(size * t), np.cos(size * t), 0.0],
                    [0, 0, 1.0],
                ]
            ),
        )
        carrier = SpatialBody(name="carrier", joint=Prescribed(motion=motion))
        hung = tuple(replace(b, parent="carrier") if b.parent == "ground" else b for b in tree.bodies)
        name = next(b.name for b in tree.bodies if not isinstance(b.joint, Welded))
        load = SpatialLoad(body=name, force=lambda t: (size * t, size**2, 1.0), point=(0.1, 0.0, 0.0))
        return replace(tree, bodies=(carrier, *hung), loads=(*tree.loads, load))

    return at


@pytest.mark.parametrize("seed", range(3))
def test_slopes_by_a_prescribed_motion_and_a_load_over_time(seed):
    rng = np.random.default_rng(70 + seed)
    at = driven(rng)
    system = at(0.7)
    run = tree_run(system, rng.uniform(0.5, 1.0, 12), TIMES, SCHEME)
    compare(system, run, far(system), SCHEME, [("size", 0.7, at)])


def test_a_peak_inside_has_slopes_by_the_start_and_by_a_place():
    """The refined peak's time moves; its slope does not ask for that."""

    def at(height, speed=2.0, arm=0.5):
        base = SpatialBody(
            name="base",
            joint=Prismatic(axis=(0, 0, 1), position=height, speed=speed),
            mass=2.0,
            inertia=(1, 1, 1),
        )
        tip = SpatialBody(
            name="tip", parent="base", joint=Revolute(axis=(0, 1, 0), speed=1.0), at=(arm, 0.0, 0.0),
            mass=1.0, centre=(0.3, 0.0, 0.0), inertia=(0.1, 0.1, 0.1),
        )  # fmt: skip
        return TreeSystem(bodies=(base, tip))

    times = np.linspace(0.0, 0.4, 41)
    objective = Maximum(quantity=Coordinate(bodies=("tip",), direction=(0.6, 0.0, 0.8)))
    run = tree_run(at(1.0), np.zeros(0), times, SCHEME)
    assert 0.05 < objective.peaks(run)[0].time < 0.35
    parameters = {
        "height": (1.0, at), "speed": (2.0, lambda x: at(1.0, x)), "arm": (0.5, lambda x: at(1.0, 2.0, x)),
    }  # fmt: skip
    found = parameter_slopes(run, objective, parameters)
    for name, (value, system) in parameters.items():
        expected = along(
            lambda e, v=value, s=system: objective.value(tree_run(s(v + e), np.zeros(0), times, SCHEME)), 1e-3
        )
        assert found[name] == pytest.approx(expected, rel=1e-8, abs=1e-10)
