"""What is done with results once they are stored: verified, compared, cleaned, exported, shown."""
