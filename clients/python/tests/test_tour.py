"""The tour of `docs/guide/python.md`: its blocks run in order, and print what stands behind them."""

import contextlib
import io
import os
import re
from pathlib import Path

import pytest

from .support.server import serving

PAGE = Path(__file__).parents[3] / "docs" / "guide" / "python.md"

PRINTED = re.compile(r"^ *print\(.*\)   # (.*)$", re.MULTILINE)


def test_the_tour_does_what_it_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert len(blocks) > 15
    with serving(tmp_path) as server:
        monkeypatch.chdir(tmp_path)
        names: dict[str, object] = {}
        checked = 0
        for block in blocks:
            assert block.count("print(") == len(PRINTED.findall(block)), block
            said = io.StringIO()
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(io.StringIO()):
                exec(block.replace("localhost:7333", server.address), names)  # noqa: S102
            assert said.getvalue().splitlines() == PRINTED.findall(block), block
            checked += len(PRINTED.findall(block))
        assert checked > 25
    assert os.path.exists("floor1.mrol")
