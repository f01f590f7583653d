"""The libraries that libsumo wants from the system are known, found, and named when they are missing."""

import mmap
import struct
import subprocess
import sys
from importlib.metadata import files
from pathlib import Path

import pytest

from clo_fleet.errors import CloFleetError
from clo_fleet.sim.preflight import NEEDED, MissingLibrary, MissingLibraryError, check_libsumo, main, missing_libraries

C_LIBRARY = {
    "ld-linux-x86-64.so.2",
    "libc.so.6",
    "libdl.so.2",
    "libgcc_s.so.1",  # comes with every libstdc++
    "libm.so.6",
    "libpthread.so.0",
    "libresolv.so.2",
    "librt.so.1",
}
ROOT = Path(__file__).parents[3]
ABSENT = MissingLibrary("libno-such-thing.so.7", "libno-such-thing7", "no-such-thing")

linux_only = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems bring their own libraries")


def needed_by(path: Path) -> set[str]:
    """The sonames in the dynamic section of a 64-bit ELF file: what the linker must find to load it."""
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as elf:
        table, size, count = *struct.unpack_from("<Q", elf, 32), *struct.unpack_from("<HH", elf, 54)
        headers = [struct.unpack_from("<IIQQQQ", elf, table + size * i) for i in range(count)]
        loads = [(address, offset, length) for kind, _, offset, address, _, length in headers if kind == 1]
        offset, length = next((offset, length) for kind, _, offset, _, _, length in headers if kind == 2)
        entries = list(struct.iter_unpack("<qQ", elf[offset : offset + length]))
        strings = next(value for tag, value in entries if tag == 5)
        at = next(offset + strings - first for first, offset, length in loads if first <= strings < first + length)
        return {elf[at + name : elf.find(b"\0", at + name)].decode() for tag, name in entries if tag == 1}


@linux_only
def test_table_names_all_that_libsumo_takes_from_the_system() -> None:
    """Every library that the shipped binaries need is shipped too, part of the C library, or in the table."""
    shipped = [Path(str(file.locate())) for file in files("libsumo") or () if ".so" in file.name]
    wanted = {soname for path in shipped for soname in needed_by(path)}
    assert wanted - {path.name for path in shipped} - C_LIBRARY == {library.soname for library in NEEDED}


def test_machine_that_runs_the_tests_lacks_nothing() -> None:
    """The check passes here, in process and from a shell."""
    check_libsumo()
    assert subprocess.run([sys.executable, "-m", "clo_fleet.sim.preflight"], check=False).returncode == 0


def test_check_loads_no_third_party_module() -> None:
    """It can run on a machine on which nothing has been installed yet."""
    code = "import sys, clo_fleet.sim.preflight; print(*{name.partition('.')[0] for name in sys.modules})"
    shell = subprocess.run([sys.executable, "-S", "-c", code], check=True, capture_output=True, text=True, cwd=ROOT)
    assert set(shell.stdout.split()) - sys.stdlib_module_names - {"__main__"} == {"clo_fleet"}


@linux_only
def test_absent_library_is_missing_and_a_present_one_is_not() -> None:
    """What the linker cannot load is returned, and only that."""
    assert missing_libraries((NEEDED[0], ABSENT)) == (ABSENT,)


def test_other_systems_miss_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the Linux wheel takes libraries from the system."""
    monkeypatch.setattr(sys, "platform", "darwin")
    assert missing_libraries((ABSENT,)) == ()


def test_error_names_every_library_and_package() -> None:
    """One message is enough to install all that is missing, on either family of systems."""
    error = MissingLibraryError((NEEDED[0], ABSENT))
    assert isinstance(error, CloFleetError)
    assert error.libraries == (NEEDED[0], ABSENT)
    assert "libGL.so.1, libno-such-thing.so.7" in str(error)
    assert "apt-get install libgl1 libno-such-thing7" in str(error)
    assert "dnf install libglvnd-glx no-such-thing" in str(error)


def test_names_of_packages_alone_can_be_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    """With ``--debian`` the output can be handed to apt-get; nothing is missing here, so it is empty."""
    assert main(["--debian"]) == 0
    assert capsys.readouterr().out.strip() == ""
