"""Does this machine have the system libraries that libsumo loads?

The wheels of libsumo carry most of what they need, but take the X11 and OpenGL client libraries from the system even
though no window is ever opened. Without one of them ``import libsumo`` fails with a bare linker message; asking first
lets us name the package to install. ``python -m clo_fleet.sim.preflight`` asks from a shell, also where nothing has
been installed yet.
"""

import ctypes
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from clo_fleet.errors import CloFleetError

__all__ = ["NEEDED", "MissingLibrary", "MissingLibraryError", "check_libsumo", "main", "missing_libraries"]


@dataclass(frozen=True, slots=True)
class MissingLibrary:
    """A shared library that libsumo takes from the system.

    Attributes:
        soname: the name that the linker looks for.
        debian: the package that holds it on Debian and Ubuntu.
        fedora: the package that holds it on Fedora and its kin.
    """

    soname: str
    debian: str
    fedora: str


NEEDED = (
    MissingLibrary("libGL.so.1", "libgl1", "libglvnd-glx"),
    MissingLibrary("libX11.so.6", "libx11-6", "libX11"),
    MissingLibrary("libXext.so.6", "libxext6", "libXext"),
    MissingLibrary("libXrender.so.1", "libxrender1", "libXrender"),
    MissingLibrary("libatomic.so.1", "libatomic1", "libatomic"),
    MissingLibrary("libexpat.so.1", "libexpat1", "expat"),
    MissingLibrary("libstdc++.so.6", "libstdc++6", "libstdc++"),
    MissingLibrary("libz.so.1", "zlib1g", "zlib"),
)
"""All that the Linux wheel of libsumo 1.28 needs beyond itself and the C library (a test reads the wheel)."""


class MissingLibraryError(CloFleetError):
    """The traffic engine cannot be loaded: the system lacks libraries.

    Attributes:
        libraries: what is missing.
    """

    def __init__(self, libraries: tuple[MissingLibrary, ...]) -> None:
        sonames = ", ".join(library.soname for library in libraries)
        debian = " ".join(library.debian for library in libraries)
        fedora = " ".join(library.fedora for library in libraries)
        super().__init__(
            f"libsumo needs system libraries that are not installed: {sonames}\n"
            f"  Debian, Ubuntu: apt-get install {debian}\n"
            f"  Fedora:         dnf install {fedora}"
        )
        self.libraries = libraries


def missing_libraries(needed: Sequence[MissingLibrary] = NEEDED) -> tuple[MissingLibrary, ...]:
    """What of ``needed`` the linker cannot load, in its order; nothing where libsumo does not load from the system.

    The libraries are loaded, not looked up: one that is there but lacks a dependency of its own is missing too.
    """
    if not sys.platform.startswith("linux"):
        return ()
    return tuple(library for library in needed if not _loads(library.soname))


def check_libsumo() -> None:
    """Return if the system has what libsumo needs; call it before ``import libsumo``.

    Raises:
        MissingLibraryError: something is missing; the message says which package to install.
    """
    if missing := missing_libraries():
        raise MissingLibraryError(missing)


def main(arguments: Sequence[str]) -> int:
    """Say what is missing and how to install it; with ``--debian`` print only the names of the packages.

    Returns:
        1 if something is missing, else 0.
    """
    missing = missing_libraries()
    if "--debian" in arguments:
        print(*(library.debian for library in missing))
    elif missing:
        print(MissingLibraryError(missing), file=sys.stderr)
    return 1 if missing else 0


def _loads(soname: str) -> bool:
    try:
        ctypes.CDLL(soname)
    except OSError:
        return False
    return True


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
