"""Parameters with units and bounds, their laws, groups, scenarios and random streams."""
