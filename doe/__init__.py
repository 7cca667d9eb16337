"""Points in the unit cube: samplers, exchange algorithms and the quality of a design."""

__distribution__ = "holdfast"

__all__: list[str] = []
