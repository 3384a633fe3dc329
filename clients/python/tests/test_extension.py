"""The package without its extension, and with one of another version."""

import subprocess
import sys
from importlib.metadata import requires, version
from pathlib import Path

import pytest

import mrol


def said(program: str, folder: Path) -> str:
    """What a program prints that finds modules in a folder first."""
    begin = f"import sys; sys.path.insert(0, {str(folder)!r})\n"
    done = subprocess.run([sys.executable, "-c", begin + program], capture_output=True, text=True, check=True)
    return done.stdout


IMPORTING = """
import mrol
try:
    import mrol.replica
except ImportError as error:
    print(error)
"""


def test_without_the_extension_the_error_says_what_to_install(tmp_path: Path) -> None:
    told = said(f"sys.modules['mrol_native'] = None\n{IMPORTING}", tmp_path)
    assert told.startswith(f"mrol.replica needs mrol-replica {mrol.__version__}, which is not installed: ")
    assert "`pip install ./clients/python ./clients/python-replica`" in told


def test_an_extension_of_another_version_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mrol_native.py").write_text("__version__ = '0.0.1'\n")
    told = said(IMPORTING, tmp_path)
    assert told.startswith(f"mrol is {mrol.__version__} and mrol-replica 0.0.1, which do not fit: ")


def test_an_extension_that_fails_itself_is_not_taken_for_none(tmp_path: Path) -> None:
    (tmp_path / "mrol_native.py").write_text("import no_module_of_that_name\n")
    assert said(IMPORTING, tmp_path).strip() == "No module named 'no_module_of_that_name'"


def test_the_package_needs_numpy_alone(tmp_path: Path) -> None:
    told = said("import mrol; print(*{name.partition('.')[0] for name in sys.modules} - sys.stdlib_module_names)", tmp_path)
    assert {"mrol", "numpy"} <= set(told.split())
    assert "typing_extensions" not in told


def test_the_versions_are_one() -> None:
    assert version("mrol") == mrol.__version__
    pinned = [of for of in requires("mrol") or [] if of.startswith("mrol-replica")]
    assert [of.split(";")[0].strip() for of in pinned] == [f"mrol-replica=={mrol.__version__}"]


def test_importing_the_package_imports_no_extension(tmp_path: Path) -> None:
    (tmp_path / "mrol_native.py").write_text("raise RuntimeError\n")
    assert said("import mrol; print('mrol.replica' in sys.modules)", tmp_path).strip() == "False"
    with pytest.raises(subprocess.CalledProcessError):
        said("import mrol.replica", tmp_path)
