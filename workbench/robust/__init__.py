"""Designs compared over the uncertainty, and searched against their worst scenario."""
