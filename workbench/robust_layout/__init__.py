"""The robust loop: layouts of the engine for uncertain cases, its oracle and its runs."""
