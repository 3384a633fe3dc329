"""The tour of `docs/guide/python-replica.md` and the package's README: blocks run in order, and print what stands behind them."""

from pathlib import Path

import pytest

from ..support.server import serving
from ..support.tours import GUIDE, run_tour

README = Path(__file__).parents[3] / "python-replica" / "README.md"


@pytest.mark.parametrize(("page", "printed"), [(GUIDE / "python-replica.md", 9), (README, 3)], ids=["guide", "README"])
def test_the_tour_does_what_it_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, page: Path, printed: int) -> None:
    with serving(tmp_path) as server:
        monkeypatch.chdir(tmp_path)
        addresses = {"localhost:7333": server.address, "localhost:7334": server.grpc}
        assert run_tour(page, addresses) >= printed
