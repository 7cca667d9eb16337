"""Members on or off: what may be chosen, outer approximation, search by predicted histories."""
