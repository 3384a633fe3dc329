"""What can be asked of a map: each module has one operation, or two that belong together, and what it answers."""
