"""Files, paths, archives, processes of the operating system."""
