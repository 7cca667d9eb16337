"""Which inputs act: the screener, its rivals, its path, its verdict and the runs it needs."""
