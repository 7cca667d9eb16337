"""Offences against the house that are being mended: each leaves this list with its mending."""

PENDING: dict[str, set[str]] = {}
