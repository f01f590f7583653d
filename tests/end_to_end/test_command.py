"""The command, typed as a user types it."""

import gzip
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from clo_fleet import __version__

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = (
    *("run", "compare", "validate", "import-map", "build-network", "init", "schema"),
    *("explain", "paper", "study-repair", "batch", "query", "report", "view", "export"),
)
Command = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def clo_fleet(tmp_path: Path) -> Command:
    """Runs the command in an empty folder."""

    def run(*arguments: object, python: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
        words = [sys.executable, *python, "-m", "clo_fleet.cli", *map(str, arguments)]
        return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=110, check=False)

    return run


@pytest.fixture
def own(clo_fleet: Command, tmp_path: Path) -> Path:
    """The maps and worlds of the package, copied out."""
    assert clo_fleet("init", "own").returncode == 0
    return tmp_path / "own"


def edited(path: Path, old: str, new: str) -> Path:
    """The file with a text replaced."""
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def test_help_names_every_command_and_imports_no_engine(clo_fleet: Command) -> None:
    """Asking for help must be quick: nothing heavy is loaded for it."""
    done = clo_fleet("--help", python=("-X", "importtime"))
    assert done.returncode == 0
    for command in COMMANDS:
        assert f"\n    {command}" in done.stdout
    loaded = {line.rpartition("|")[2].strip().partition(".")[0] for line in done.stderr.splitlines()}
    assert not loaded & {"pymunk", "libsumo", "unified_planning", "networkx", "numpy", "shapely", "pydantic", "rich"}


def test_version_is_the_packages_own(clo_fleet: Command) -> None:
    """``--version`` says what is installed."""
    assert clo_fleet("--version").stdout == f"clo-fleet {__version__}\n"


def test_run_writes_the_log_and_the_result_and_tells_what_happened(clo_fleet: Command, own: Path) -> None:
    """One run: tables, who helped whom, one outcome, two files in the default folder, exit code 0."""
    done = clo_fleet("run", own / "worlds" / "three_rooms.yaml", "--explain", "r1")
    assert (done.returncode, done.stderr) == (0, "")
    assert "dropped move(r1, l1, l2) and prepare(r1, o2, l2) and grasp(r1, o2, l2), because r2 gave o2" in done.stdout
    assert "(holding r1 o2)" in done.stdout
    assert "outcome: goals_reached" in done.stdout
    folder = own.parent / "runs" / "three_rooms-clo-0"
    lines = (folder / "events.jsonl").read_text(encoding="utf-8").splitlines()
    assert json.loads(lines[0])["kind"] == "run_started"
    assert json.loads(lines[-1])["kind"] == "run_ended"
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert (result["outcome"], result["strategy"], result["seed"]) == ("goals_reached", "clo", 0)
    r1 = result["robots"]["r1"]
    assert (r1["planned"], r1["executed"], r1["dropped"], r1["planner_calls"], r1["repairs"]) == (6, 3, 3, 1, 1)
    assert [(gift["by"], gift["robot"], gift["fact"], len(gift["dropped"])) for gift in result["helps"]] == [
        ("r2", "r1", "(holding r1 o2)", 3)
    ]


def test_run_overwrites_only_when_told_to(clo_fleet: Command, own: Path) -> None:
    """A second run into the same folder is refused and leaves it as it is, but for ``--force``."""
    world = own / "worlds" / "hello.yaml"
    assert clo_fleet("run", world, "--out", "here").returncode == 0
    before = (own.parent / "here" / "events.jsonl").read_bytes()
    refused = clo_fleet("run", world, "--out", "here", "--seed", "5")
    assert refused.returncode == 2
    assert "--force" in refused.stderr
    assert (own.parent / "here" / "events.jsonl").read_bytes() == before
    assert clo_fleet("run", world, "--out", "here", "--force").returncode == 0
    assert (own.parent / "here" / "events.jsonl").read_bytes() == before


def test_json_prints_the_result_and_fits_its_schema(clo_fleet: Command, own: Path) -> None:
    """``--json`` prints what ``result.json`` holds, and its keys are those of the schema."""
    done = clo_fleet("run", own / "worlds" / "hello.yaml", "--json", "--seed", "7")
    printed = json.loads(done.stdout)
    assert printed == json.loads((own.parent / "runs" / "hello-clo-7" / "result.json").read_text(encoding="utf-8"))
    schema = json.loads(clo_fleet("schema", "result").stdout)
    assert set(schema["properties"]) == set(printed)
    assert set(schema["$defs"]["RobotResult"]["properties"]) == set(printed["robots"]["r1"])


@pytest.mark.parametrize(("of", "keys"), [("world", "robots"), ("map", "rooms"), ("batch", "sweep")])
def test_the_schemas_of_files_name_their_keys(clo_fleet: Command, of: str, keys: str) -> None:
    """What an editor completes."""
    assert keys in json.loads(clo_fleet("schema", of).stdout)["properties"]


def test_compare_puts_the_strategies_side_by_side(clo_fleet: Command, own: Path) -> None:
    """One table; the paper's baseline calls its planner more often."""
    done = clo_fleet("compare", own / "worlds" / "hello.yaml", "--strategies", "clo,replan", "--json")
    assert done.returncode == 0
    calls = {result["strategy"]: result["robots"]["r1"]["planner_calls"] for result in json.loads(done.stdout)}
    assert calls == {"clo": 1, "replan": 2}
    table = clo_fleet("compare", own / "worlds" / "hello.yaml").stdout
    assert "planner calls" in table
    assert "replan" in table


def test_run_out_of_time_is_another_outcome(clo_fleet: Command, own: Path) -> None:
    """``--until`` ends a run; its exit code is 1, and it says what to do."""
    done = clo_fleet("run", own / "worlds" / "hello.yaml", "--until", "5")
    assert done.returncode == 1
    assert "outcome: out_of_time" in done.stdout
    assert "what to do: " in done.stdout


def test_goals_that_exclude_one_another_end_as_no_plan(clo_fleet: Command, own: Path) -> None:
    """Two robots want to keep the same cup: one gets it, and the other has no plan any more."""
    world = edited(own / "worlds" / "hello.yaml", "[(prepared cup)]", "[(holding r2 cup)]")
    done = clo_fleet("run", world)
    assert done.returncode == 1
    assert "outcome: no_plan" in done.stdout


@pytest.mark.parametrize(("limits", "says"), [("wall_limit_s: 0.02", "time"), ("memory_limit_mb: 16", "memory")])
def test_planner_that_meets_a_limit_is_an_outcome(clo_fleet: Command, own: Path, limits: str, says: str) -> None:
    """Nothing hangs: the run ends as ``planner_failed`` and says which limit it was."""
    world = edited(own / "worlds" / "hello.yaml", "until_s: 120", f"until_s: 120\nplanning: {{{limits}}}")
    done = clo_fleet("run", world)
    assert done.returncode == 1
    assert "outcome: planner_failed" in done.stdout
    assert says in done.stdout


def test_network_that_sumo_refuses_is_named(clo_fleet: Command, own: Path) -> None:
    """A spoilt network file ends with its name and what to do, not with a hang or a traceback."""
    (own / "maps" / "hello.net.xml.gz").write_bytes(gzip.compress(b"<net>no more</net>"))
    done = clo_fleet("run", own / "worlds" / "hello.yaml")
    assert done.returncode == 2
    assert "hello.net.xml.gz" in done.stderr
    assert "build-network" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (own.parent / "runs").exists()


FAULTS = (
    ("an unknown room", "room: east, at_m: [17, 4]", "room: yeast, at_m: [17, 4]", "east"),
    ("a robot in a wall", "room: west, at_m: [2, 2.5]", "room: west, at_m: [0.1, 2.5]", "r1"),
    ("an object in a wall", "at_m: [18, 2]", "at_m: [19.95, 2]", "cup"),
    ("robots on top of each other", "room: west, at_m: [2, 2.5]", "room: east, at_m: [17.2, 4]", "r2"),
    ("an unknown object in a goal", "(prepared cup)", "(prepared saucer)", "saucer"),
    ("a word for a number", "until_s: 120", "until_s: soon", "soon"),
    ("a negative time", "until_s: 120", "until_s: -1", "-1"),
    ("a wrong unit", "until_s: 120", "until_min: 2", "until_s"),
    ("a YAML bomb", "until_s: 120", "a: &a [x, x]\nb: [*a, *a]", "a"),
    ("an object tag", "until_s: 120", "until_s: !!python/object/apply:os.system [id]", "tag"),
    ("not a number", "until_s: 120", "until_s: .nan", "nan"),
    ("a duplicate", "until_s: 120", "until_s: 120\nuntil_s: 130", "until_s"),
)


@pytest.mark.parametrize(("old", "new", "names"), [fault[1:] for fault in FAULTS], ids=[fault[0] for fault in FAULTS])
def test_bad_world_is_refused_with_its_place(clo_fleet: Command, own: Path, old: str, new: str, names: str) -> None:
    """File, line and column, the value, what was expected; no traceback; nothing is written; exit code 2."""
    world = edited(own / "worlds" / "hello.yaml", old, new)
    for command in ("validate", "run"):
        done = clo_fleet(command, world)
        assert done.returncode == 2
        assert f"{world}:" in done.stderr
        assert any(f"{world}:{line}:" in done.stderr for line in range(2, 20))
        assert names in done.stderr
        assert "expected" in done.stderr
        assert "Traceback" not in done.stderr
    assert not (own.parent / "runs").exists()


@pytest.mark.parametrize("content", [b"", b"\x00\xff\x00binary", b"- a\n- list\n", None])
def test_file_that_is_no_world_is_refused(clo_fleet: Command, tmp_path: Path, content: bytes | None) -> None:
    """An empty file, a file that is not YAML, a list, a folder."""
    path = tmp_path / "world.yaml"
    path.mkdir() if content is None else path.write_bytes(content)
    done = clo_fleet("run", path)
    assert done.returncode == 2
    assert str(path) in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--strategy", "hope"), "replan-on-failure"),
        (("--explain", "r9"), "expected one of r1, r2"),
        (("--seed", "-3"), "count from 0"),
        (("--until", "soon"), "number of seconds"),
    ],
)
def test_bad_option_is_refused(clo_fleet: Command, own: Path, arguments: tuple[str, str], says: str) -> None:
    """Options are checked before anything is started."""
    done = clo_fleet("run", own / "worlds" / "hello.yaml", *arguments)
    assert done.returncode == 2
    assert says in done.stderr
    assert not (own.parent / "runs").exists()


def test_init_overwrites_nothing(clo_fleet: Command, own: Path) -> None:
    """What was copied out can be changed without fear of the next ``init``."""
    world = edited(own / "worlds" / "hello.yaml", "until_s: 120", "until_s: 121")
    done = clo_fleet("init", "own")
    assert done.returncode == 2
    assert "until_s: 121" in world.read_text(encoding="utf-8")


def test_every_shipped_file_is_sound() -> None:
    """``validate`` has nothing to say about what comes with the package."""
    files = sorted([*(ROOT / "maps").glob("*.yaml"), *(ROOT / "worlds").glob("*.yaml")])
    words = [sys.executable, "-m", "clo_fleet.cli", "validate", *map(str, files)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=110, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.count("a sound") == len(files)
