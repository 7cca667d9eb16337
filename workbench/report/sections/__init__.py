"""Sections of the report, one file each: a campaign's folder in, sentences, figures and tables out."""

__all__: list[str] = []
