"""Real clusters of dask, and what disturbs them."""
