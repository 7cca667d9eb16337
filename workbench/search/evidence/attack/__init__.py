"""The adversary of a claimed worst case: true runs that share nothing with the search that made the claim."""
