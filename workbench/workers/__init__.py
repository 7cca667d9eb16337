"""Who runs a model: processes of this machine, a Dask cluster."""
