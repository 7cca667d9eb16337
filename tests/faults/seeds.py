"""Seeds of tests that draw their faults at random: HOLDFAST_OTHER_SEEDS=70000 draws others than those that
every day sees."""

import os

__all__ = ["SHIFT"]

SHIFT = int(os.environ.get("HOLDFAST_OTHER_SEEDS", "0"))  # added to each seed
