"""What several tests use: a real server, scenes, and servers that misbehave."""
