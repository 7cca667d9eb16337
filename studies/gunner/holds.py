"""What holds the gunner at level L0: two grips that open for good, and a hanging seat or the floor."""

import numpy as np

from workbench.engine import SpatialBushing

from .figure import SIDES, Start, hanging, pieces, supports
from .figure_numbers import Numbers
from .parts import GRAVITY, triple

__all__ = ["HANDS", "hands_on", "holds"]

HANDS = ("none", "one", "both")


def hands_on(hands: str) -> dict[str, float]:
    """Which hands hold on; one is the right one, the stronger in Table 8.5."""
    if hands not in HANDS:
        raise ValueError(f"hands needs one of {', '.join(HANDS)}, got '{hands}'")
    return {"left": float(hands == "both"), "right": float(hands != "none")}


def holds(
    numbers: Numbers, *, start: Start, grip: float, hands: str = "both", seat_rate: float | None = None,
    seat_damping: float | None = None, seat_cap: float | None = None, vehicle: str = "vehicle",
) -> tuple[SpatialBushing, ...]:  # fmt: skip
    """Grips and what carries him, named "left grip", "right grip" and "seat", or "left foot", "right foot".

    grip: strength of a hand, N. hands: "none", "one" (the right) or "both". seat_rate N/m, seat_damping
    N s/m, seat_cap N, of all that carries him: None for those of the numbers. It carries the weight at rest.
    """
    body, g, p, on = pieces(numbers), numbers.grips, numbers.posture, hands_on(hands)
    hip = np.asarray(p.hip)
    # the hand comes loose from the bar towards the wrist
    opens = triple(-hanging(p.upper_arm + p.elbow))
    grips = tuple(
        SpatialBushing(
            a=f"{side} hand", b=vehicle, point_a=triple(body[f"{side} hand"].centre),
            point_b=triple(hip + body[f"{side} hand"].at + body[f"{side} hand"].centre),
            k=g.stiffness, c=g.damping, cap=g.breakaway_factor * grip, slip=g.slip, release=g.release,
            tau=g.loss_time, width=g.loss_width, eps=g.rounding, hold=on[side], opens=opens, push_cap=g.push,
            name=f"{side} grip",
        )
        for side in SIDES
    )  # fmt: skip
    s, under = numbers.seat, supports(numbers, start)
    share = 1.0 / len(under)
    carried = tuple(
        SpatialBushing(
            a=name, b=vehicle, point_a=at, point_b=triple(hip + body[name].at + at),
            k=share * (s.stiffness if seat_rate is None else seat_rate),
            c=share * (s.damping if seat_damping is None else seat_damping),
            cap=share * (s.cap if seat_cap is None else seat_cap), slip=s.slip, release=s.release,
            tau=g.loss_time, width=g.loss_width, eps=g.rounding,
            preload=(0.0, 0.0, share * numbers.figure.mass * GRAVITY),
            name="seat" if len(under) == 1 else name,
        )
        for name, at in under.items()
    )  # fmt: skip
    return (*grips, *carried)
