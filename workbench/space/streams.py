"""One seed per study, one stream per purpose: a new stage never changes anybody else's numbers."""

from hashlib import blake2b

import numpy as np

__all__ = ["stream"]


def stream(seed: int, purpose: str, *, replicate: int = 0) -> np.random.Generator:
    """The generator of `purpose` under `seed`.

    The spawn key is a hash of the purpose's name, not a position in a list, so streams do not move when a
    stage is added.

    >>> a, b = stream(1, "lhs"), stream(1, "screening")
    >>> bool(a.random() == stream(1, "lhs").random()), bool(a.random() == b.random())
    (True, False)
    """
    if seed < 0:
        raise ValueError(f"seed needs a whole number >= 0, got {seed}")
    word = int.from_bytes(blake2b(purpose.encode(), digest_size=4).digest(), "little")
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(word, replicate)))
