"""Where the search runs next."""
