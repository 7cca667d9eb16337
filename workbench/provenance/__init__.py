"""States of a model: the code, files, programs and circumstances that made a run."""
