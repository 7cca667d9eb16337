"""All that the specification asks of vehicle, gunner, figures of merit and restraints, and ours beside it.

    python -m studies.gunner.checks                 every row: V, G, L1, M, R (a quarter of an hour)
    python -m studies.gunner.checks metrics vehicle some of: metrics, vehicle, gunner, contacts

V14, the second engine, has its traces among the tests: `tests/laws/studies/test_gunner_second_engine.py`.
"""

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence

from .. import occupant_acceptance
from ..vehicle import acceptance
from ..vehicle.acceptance import Row
from . import contacts, metrics

__all__ = ["PARTS", "main"]

PARTS: Mapping[str, Callable[[], Iterable[Row]]] = {
    "metrics": metrics.table,
    "vehicle": acceptance.table,
    "gunner": occupant_acceptance.table,
    "contacts": contacts.table,
}


def main(names: Sequence[str]) -> int:
    """Print the rows of some parts, or all, and how many are missed; 2 for a part that there is not."""
    unknown = [name for name in names if name not in PARTS]
    if unknown:
        print(f"parts are {', '.join(PARTS)}, got {', '.join(unknown)}")
        return 2
    rows: list[Row] = []
    for name in names or PARTS:
        for row in PARTS[name]():
            rows.append(row)
            verdict = "pass" if row.passes else "MISS"
            print(f"{row.check:4} {row.what:45} {row.asked:28} {row.ours:12.5g}  {verdict}", flush=True)
    missed = [f"{row.check} {row.what}" for row in rows if not row.passes]
    print(f"{len(rows) - len(missed)} of {len(rows)} rows pass" + "".join(f"\n  missed: {m}" for m in missed))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
