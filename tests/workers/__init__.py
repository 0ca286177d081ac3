"""Worker processes, and long trials that go on."""
