"""Scan files: read as the program `mrol` reads them, and found in folders."""
