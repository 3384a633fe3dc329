"""Fixtures of the tests with real ROS."""

import pytest


@pytest.fixture
def server(tmp_path):
    """A server with a folder of its own."""
    from .live.support import Server  # noqa: PLC0415

    started = Server(tmp_path)
    started.start()
    yield started
    started.kill()
