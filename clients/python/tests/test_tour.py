"""The tour of `docs/guide/python.md`: its blocks run in order, and print what stands behind them."""

import os
from pathlib import Path

import pytest

from .support.server import serving
from .support.tours import GUIDE, run_tour


def test_the_tour_does_what_it_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(tmp_path) as server:
        monkeypatch.chdir(tmp_path)
        assert run_tour(GUIDE / "python.md", {"localhost:7333": server.address}) > 25
    assert os.path.exists("python-tour.mrol")
