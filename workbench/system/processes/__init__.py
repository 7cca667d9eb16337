"""Processes that run beside this one: how they end, what time they take, and what they are started with."""
