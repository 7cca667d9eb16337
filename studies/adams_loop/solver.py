#!/usr/bin/env python3
"""A stand-in for a multibody solver: reads a deck, integrates it, writes requests. Needs nothing but Python.

    solver.py deck.adm deck.req

The mechanism: torso (angle a) on the hip, head (angle b) on the neck, both measured forward from upright, on
a seat whose deceleration s(t) throws them forward; a belt holds the chest once its slack is used up.

    M(a, b) (a'', b'') = moments of hip and neck springs, gravity, pulse, and the belt at height h
    belt force f = K e + C e' for e = h sin a - slack > 0 (never a push), else 0

Integrated by the classical Runge-Kutta method. Ends with code 1 and a line of text when the deck is wrong or
the motion leaves all bounds.
"""

import math
import sys
from collections.abc import Sequence

__all__ = ["main", "motion", "parse"]

Deck = dict[str, dict[str, float]]

GRAVITY = 9.81
NEEDED = {
    "TORSO": ("MASS", "LENGTH"),
    "HEAD": ("MASS", "LENGTH"),
    "HIP": ("K", "C"),
    "NECK": ("K", "C"),
    "CHEST": ("HEIGHT", "K", "C", "SLACK"),
    "SEAT": ("PEAK", "DURATION"),
    "RUN": ("END", "STEPS"),
}


def parse(text: str) -> Deck:
    """Statements `KIND/ NAME, KEY = value, ...` as {NAME: {KEY: value}}; ends at END."""
    deck: Deck = {}
    for number, line in enumerate(text.splitlines(), start=1):
        line = line.strip()
        if not line or line.startswith("!"):
            continue
        if line == "END":
            break
        try:
            name, *pairs = line.split("/", 1)[1].split(",")
            deck[name.strip()] = {k.strip(): float(v) for k, v in (pair.split("=") for pair in pairs)}
        except (IndexError, ValueError):
            raise SystemExit(f"line {number} is no statement: {line}") from None
    missing = [f"{n}.{k}" for n, keys in NEEDED.items() for k in keys if k not in deck.get(n, {})]
    if missing:
        raise SystemExit(f"the deck lacks {', '.join(missing)}")
    return deck


def motion(deck: Deck) -> list[tuple[float, ...]]:
    """Rows (t, a, b, belt force, forward place of the top of the head) at every step."""
    torso, head, hip, neck = deck["TORSO"], deck["HEAD"], deck["HIP"], deck["NECK"]
    belt, seat, run = deck["CHEST"], deck["SEAT"], deck["RUN"]
    m1, l1, m2, l2 = torso["MASS"], torso["LENGTH"], head["MASS"], head["LENGTH"]
    i1, i2 = m1 * l1 * l1 / 3 + m2 * l1 * l1, m2 * l2 * l2 / 3

    def force(a: float, va: float) -> float:
        stretch = belt["HEIGHT"] * math.sin(a) - belt["SLACK"]
        if stretch <= 0:
            return 0.0
        return max(belt["K"] * stretch + belt["C"] * belt["HEIGHT"] * math.cos(a) * va, 0.0)

    def rate(t: float, a: float, b: float, va: float, vb: float) -> tuple[float, ...]:
        s = seat["PEAK"] * math.sin(math.pi * t / seat["DURATION"]) if t < seat["DURATION"] else 0.0
        coupling = m2 * l1 * l2 / 2
        c, d = math.cos(a - b), math.sin(a - b)
        lever1, lever2 = (m1 / 2 + m2) * l1, m2 * l2 / 2
        at_neck = neck["K"] * (b - a) + neck["C"] * (vb - va)
        q1 = lever1 * (GRAVITY * math.sin(a) + s * math.cos(a)) - hip["K"] * a - hip["C"] * va + at_neck
        q1 -= force(a, va) * belt["HEIGHT"] * math.cos(a) + coupling * d * vb * vb
        q2 = lever2 * (GRAVITY * math.sin(b) + s * math.cos(b)) - at_neck + coupling * d * va * va
        det = i1 * i2 - (coupling * c) ** 2
        return va, vb, (i2 * q1 - coupling * c * q2) / det, (i1 * q2 - coupling * c * q1) / det

    steps, h = int(run["STEPS"]), run["END"] / run["STEPS"]
    state: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    rows: list[tuple[float, ...]] = []
    for k in range(steps + 1):
        t, (a, b, va, _) = k * h, state
        if not all(abs(x) < 1e6 for x in state):
            raise SystemExit(f"the motion left all bounds at t = {t:g} s")
        rows.append((t, a, b, force(a, va), l1 * math.sin(a) + l2 * math.sin(b)))
        k1 = rate(t, *state)
        k2 = rate(t + h / 2, *moved(state, k1, h / 2))
        k3 = rate(t + h / 2, *moved(state, k2, h / 2))
        k4 = rate(t + h, *moved(state, k3, h))
        slope = [(p + 2 * q + 2 * r + s) / 6 for p, q, r, s in zip(k1, k2, k3, k4, strict=True)]
        state = moved(state, slope, h)
    return rows


def moved(state: Sequence[float], slope: Sequence[float], h: float) -> tuple[float, ...]:
    """The state after a step h along a slope."""
    return tuple(x + h * r for x, r in zip(state, slope, strict=True))


def main(deck_file: str, request_file: str) -> None:
    """Read, integrate, write."""
    with open(deck_file) as file:
        deck = parse(file.read())
    rows = motion(deck)
    with open(request_file, "w") as file:
        file.write("! requests of the stand-in solver\n")
        file.write("REQUEST CHEST\nTIME FM\n")
        file.writelines(f"{t:.6E} {f:.9E}\n" for t, _, _, f, _ in rows)
        file.write("\nREQUEST HEAD\nTIME ANGLE DX\n")
        file.writelines(f"{t:.6E} {b:.9E} {x:.9E}\n" for t, _, b, _, x in rows)
    print(f"{len(rows)} steps")


if __name__ == "__main__":
    main(*sys.argv[1:])
