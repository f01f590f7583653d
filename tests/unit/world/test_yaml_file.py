"""Reading YAML that strangers wrote: values with places, and a located fault for everything that is refused."""

import contextlib
import pickle
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from clo_fleet.world.faults import FileFaultsError, Finding
from clo_fleet.world.yaml_file import MAX_BYTES, MAX_DEPTH, FileWriteError, YamlFile, read_yaml, write_yaml


def read(folder: Path, text: str) -> YamlFile:
    """The text, read as a file."""
    path = folder / "a.yaml"
    path.write_text(text, encoding="utf-8")
    return read_yaml(path)


def refusal(folder: Path, text: str | bytes) -> str:
    """The one fault of the text, without the file's name."""
    path = folder / "a.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    try:
        faults = read_yaml(path).faults
    except FileFaultsError as error:
        faults = error.faults
    assert len(faults) == 1
    return str(faults[0]).removeprefix(f"{path}:")


def test_values_follow_the_core_schema(tmp_path: Path) -> None:
    """Numbers, truth and nothing are read; everything else is text."""
    text = "[1, -2.5, 1e3, .5, true, null, ~, no, 2024-01-01, '3', 0x10, 1_000, .inf]"
    values = (1, -2.5, 1000.0, 0.5, True, None, None, "no", "2024-01-01", "3", "0x10", "1_000", float("inf"))
    content = read(tmp_path, f"a: {text}\n").content["a"]
    assert content == values
    assert isinstance(content, tuple)
    assert [type(item) for item in content] == [type(value) for value in values]


def test_every_key_and_item_has_its_place(tmp_path: Path) -> None:
    """A place is that of the key in a mapping and of the item in a list."""
    file = read(tmp_path, "a: 1\nb:\n  - x: {y: 2}\n  - [3, z]\n")
    assert file.places[("a",)] == (1, 1)
    assert file.places[("b", 0)] == (3, 5)
    assert file.places[("b", 0, "x", "y")] == (3, 9)
    assert file.places[("b", 1, 1)] == (4, 9)


def test_a_finding_about_a_missing_key_is_at_the_section_that_misses_it(tmp_path: Path) -> None:
    """The fault still names the missing key."""
    fault = read(tmp_path, "a: 1\nb: {c: 2}\n").fault(Finding(("b", "d"), "a number"))
    assert (fault.line, fault.column, fault.key, fault.value) == (2, 1, "b.d", "nothing")


@pytest.mark.parametrize(
    ("text", "start", "words"),
    [
        ("", "1:1: (the file): got an empty file", "keys with values"),
        ("# only this\n", "1:1: (the file): got an empty file", "keys with values"),
        ("---\n", "1:1: (the file): got an empty file", "keys with values"),
        ("- 1\n", "1:1: (the file): got [1]", "keys with values"),
        ("just text\n", "1:1: (the file): got 'just text'", "keys with values"),
        ("a: 1\n---\nb: 2\n", "2:1: (the file): got a second document", "one document"),
        ("a: [1,\n", "2:1: (the file): got ", "YAML"),
        ("a: 1\n\tb: 2\n", "2:1: (the file): got 'b: 2'", "YAML"),
        ("a: b: c\n", "1:5: (the file): got 'a: b: c'", "YAML"),
        ("a: 1\nb: {c: 1, c: 2}\n", "2:11: b.c: got the key twice", "already stands on line 2"),
        ("a: &x 1\n", "1:4: a: got the anchor 'x'", "anchors and aliases are not read"),
        ("a: 1\nb: *x\n", "2:4: b: got the alias 'x'", "anchors and aliases are not read"),
        ("a: !!python/object/apply:os.system [ls]\n", "1:4: a: got the tag", "cannot name objects"),
        ("a: !mine 1\n", "1:4: a: got the tag '!mine'", "cannot name objects"),
        ("? [a]\n: 1\n", "1:3: (the file): got a key that is not plain text", "a name"),
        ('a: "\\ud800"\n', "1:4: a: got '\\ud800'", "Unicode"),
        ('a: "\\UFFFFFFFF"\n', "1:1: (the file): got", "YAML"),
        ("%YAML 1.9\n---\na: 1\n", "1:1: (the file): got", "YAML"),
        (b"a: 1\nb: \xff\n", "2:4: (the file): got bytes that are not UTF-8", "UTF-8"),
        (b"a: 1\x00\n", "1:5: (the file): got the character '\\x00'", "UTF-8"),
        (b"\x1f\x8b\x08\x00", "1:2: (the file): got bytes that are not UTF-8", "UTF-8"),
        (b"a: 1\n" * (MAX_BYTES // 5 + 1), "1:1: (the file): got a larger file", "5 MB"),
        ("a: " + "[" * MAX_DEPTH + "]" * MAX_DEPTH, f"1:{3 + MAX_DEPTH}: (the file): got values nested", "50 levels"),
    ],
)
def test_what_is_refused_is_told_with_its_place(tmp_path: Path, text: str | bytes, start: str, words: str) -> None:
    """Each kind of bad input is one located fault."""
    fault = refusal(tmp_path, text)
    assert fault.startswith(start)
    assert words in fault.partition("expected")[2]


def test_a_bomb_of_aliases_is_refused_at_every_alias(tmp_path: Path) -> None:
    """Aliases are not expanded at all, so that their number does not matter."""
    lines = ["a0: &a0 [x, x]"] + [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)]
    faults = read(tmp_path, "\n".join(lines)).faults
    assert len(faults) == 9 + 8 * 9


@pytest.mark.parametrize(("name", "words"), [("missing.yaml", "no such file"), (".", "a folder"), ("x" * 300, "file")])
def test_what_is_no_file_is_refused(tmp_path: Path, name: str, words: str) -> None:
    """A folder, a missing file and an impossible name are faults of the file."""
    with pytest.raises(FileFaultsError, match=words) as error:
        read_yaml(tmp_path / name)
    assert (error.value.faults[0].line, error.value.faults[0].column) == (1, 1)


def test_control_characters_of_a_file_never_reach_a_terminal(tmp_path: Path) -> None:
    """Values and keys are shown escaped."""
    file = read(tmp_path, '"\\e[31m": "\\e[0m"\n')
    assert "\x1b" not in str(file.fault(Finding(("\x1b[31m",), "nothing of the kind")))


def test_faults_survive_pickling(tmp_path: Path) -> None:
    """A batch reads worlds in other processes."""
    with pytest.raises(FileFaultsError) as error:
        read(tmp_path, "")
    assert pickle.loads(pickle.dumps(error.value)).faults == error.value.faults  # noqa: S301


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(alphabet="ab:-?[]{}&*!|>%'\"\\#,~.0123 \n\t\u2028\ufeffux", max_size=60) | st.binary(max_size=40))
def test_any_bytes_are_read_or_refused(tmp_path: Path, content: str | bytes) -> None:
    """No foreign exception comes out, whatever stands in the file."""
    path = tmp_path / "any.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with contextlib.suppress(FileFaultsError):
        read_yaml(path)


def test_a_failed_write_leaves_the_folder_as_it_was(tmp_path: Path) -> None:
    """A file that cannot be written raises, and no draft stays behind."""
    (tmp_path / "taken").mkdir()
    with pytest.raises(FileWriteError):
        write_yaml(tmp_path / "taken", {"a": 1})
    assert [entry.name for entry in tmp_path.iterdir()] == ["taken"]
