"""Pages that are run: the tour of `docs/guide/python.md`, block by block, and the first lines of the package's pages."""

import os
import re
import subprocess
from pathlib import Path

import pytest

from .support.server import serving
from .support.tours import GUIDE, PRINTED, run_tour

README = Path(__file__).parents[1] / "README.md"


def test_the_tour_does_what_it_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with serving(tmp_path) as server:
        monkeypatch.chdir(tmp_path)
        assert run_tour(GUIDE / "python.md", {"localhost:7333": server.address}) > 25
    assert os.path.exists("python-tour.mrol")


def test_the_first_lines_run_in_a_clean_environment(tmp_path: Path) -> None:
    text = README.read_text(encoding="utf-8")
    (install,) = re.findall(r"^```sh\n(python3 -m venv target/venv .*?)^```", text, re.MULTILINE | re.DOTALL)
    assert install in (GUIDE / "python.md").read_text(encoding="utf-8")
    first = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)[0]
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("MROL_", "PYTHON"))}

    def said(commands: str) -> str:
        command = ["bash", "-euo", "pipefail", "-c", commands]
        done = subprocess.run(command, cwd=README.parents[2], env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    assert "m = mrol.connect(" in said(install.replace("target/venv", str(tmp_path / "venv")))
    with serving(tmp_path) as server:
        program = tmp_path / "first.py"
        program.write_text(first.replace("localhost:7333", server.address), encoding="utf-8")
        printed = PRINTED.findall(first)
        assert len(printed) > 1
        assert said(f"{tmp_path}/venv/bin/python {program}").splitlines() == printed
