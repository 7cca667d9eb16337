"""study.toml as one typed file: schema, messages, tables."""
