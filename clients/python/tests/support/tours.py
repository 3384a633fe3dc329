"""Pages of the guide whose blocks are run, and print what stands behind them."""

import contextlib
import io
import re
from collections.abc import Mapping
from pathlib import Path

GUIDE = Path(__file__).parents[4] / "docs" / "guide"

PRINTED = re.compile(r"^ *print\(.*\) {2,3}# (.*)$", re.MULTILINE)


def run_tour(page: Path, addresses: Mapping[str, str]) -> int:
    """Runs the blocks of a page in order, with other addresses than it has; how many lines were printed as it says."""
    blocks = re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    names: dict[str, object] = {}
    checked = 0
    for block in blocks:
        assert block.count("print(") == len(PRINTED.findall(block)), block
        given = block
        for address, used in addresses.items():
            given = given.replace(address, used)
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(io.StringIO()):
            exec(given, names)  # noqa: S102
        assert said.getvalue().splitlines() == PRINTED.findall(block), block
        checked += len(PRINTED.findall(block))
    return checked
