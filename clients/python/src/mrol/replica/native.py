"""The extension, where it is installed, of the same version as this package."""

from .. import __version__
from . import failures

INSTALL = "from a checkout of that version, `pip install ./clients/python ./clients/python-replica` compiles and installs both"

try:
    import mrol_native
except ModuleNotFoundError as error:
    if error.name != "mrol_native":
        raise
    raise ImportError(f"mrol.replica needs mrol-replica {__version__}, which is not installed: {INSTALL}") from error

if mrol_native.__version__ != __version__:
    raise ImportError(f"mrol is {__version__} and mrol-replica {mrol_native.__version__}, which do not fit: {INSTALL}")

mrol_native.set_exceptions(failures.exception, failures.argument)

__all__ = ["mrol_native"]
