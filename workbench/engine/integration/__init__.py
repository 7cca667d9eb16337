"""Time integration: schemes, loops and charts that know no kind of system."""
