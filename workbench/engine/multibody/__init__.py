"""Systems, joints, members, integrators, trajectories and objectives."""
