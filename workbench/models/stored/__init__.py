"""A run as it is stored: its record, why it failed, and very many of them in chunks."""
