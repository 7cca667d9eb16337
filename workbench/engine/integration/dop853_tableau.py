"""The order-8 tableau of Dormand and Prince as scipy publishes it (`scipy.integrate.DOP853`)."""

import numpy as np
from scipy.integrate import DOP853

__all__ = ["STAGES", "A", "B", "C"]

STAGES = 12
A = np.ascontiguousarray(DOP853.A[:STAGES, :STAGES])
B = np.ascontiguousarray(DOP853.B[:STAGES])
C = np.ascontiguousarray(DOP853.C[:STAGES])
