"""Requests over HTTP: addresses, connections, deadlines, retries, keys. It knows nothing of maps."""
