"""Kriging by restricted maximum likelihood, screening of inputs and validation."""

__distribution__ = "holdfast"

__all__: list[str] = []
