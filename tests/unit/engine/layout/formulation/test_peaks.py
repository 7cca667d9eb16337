"""Peaks of histories and their neighbours as rows."""

import numpy as np

from workbench.engine.layout.formulation.peaks import local_peaks, rows_with_neighbours


def test_peaks_and_their_neighbours():
    values = np.array([[0.0, 1.0, 0.5, 2.0, 2.0], [3.0, 1.0, 1.0, 0.0, 5.0]])
    assert local_peaks(values).tolist() == [1, 4, 5, 7, 9]
    assert local_peaks(values, above=1.5).tolist() == [4, 5, 9]
    assert rows_with_neighbours(values, np.array([5, 9]), (-1, 0, 1)).tolist() == [5, 6, 8, 9]
