"""Runs of a study in its folder: store, lock, supervisor, ask and tell, exports, histories, failures."""
