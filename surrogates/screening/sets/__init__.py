"""The search for the set of active inputs, one method a file."""
