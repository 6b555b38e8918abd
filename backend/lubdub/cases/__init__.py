"""People around a result: the case, its files, its keys, its deletion. Knows nothing of geometry or the web."""
