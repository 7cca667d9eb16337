"""Members on or off: what may be chosen, outer approximation, search in what a response sees."""
