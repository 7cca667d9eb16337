"""The embedded multibody and layout engine: SI numbers in; trajectories, gradients and layouts out.

It knows no design of experiments, no study file and no xarray; it needs numpy, scipy and numba alone.
"""

__distribution__ = "holdfast"
