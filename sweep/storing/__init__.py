"""Studies as parquet files, in a folder or an object store, each part whole or absent."""
