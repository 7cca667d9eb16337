"""How kernels are compiled: options, passes, records that travel as one pointer, small dense algebra."""
