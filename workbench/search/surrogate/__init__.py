"""The Kriging of a search: output transform, feasibility, expected improvement."""
