"""Is what a store holds what was stored? Checksums of its rows, and what it must hold at least."""
