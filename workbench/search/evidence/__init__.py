"""How sure a worst case is: gap, certificates, corner audit, baselines."""
