"""Trees of these tests are compiled for every element, so that they share one set of kernels with others."""

from tests.sample_trees import one_set_of_kernels

__all__ = ["one_set_of_kernels"]
