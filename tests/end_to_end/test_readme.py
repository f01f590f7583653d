"""What README shows is what happens."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize(
    ("number", "says"),
    [
        (0, "goals_reached 3 (holding r1 o2)"),
        (1, "satisfied 2 executed"),
        (2, "SOLVED_SATISFICING [unload(l1)] deletion"),
    ],
)
def test_a_program_in_the_readme_runs_as_it_stands(number: int, says: str) -> None:
    """Copied out of README and run in the checkout, each program ends with the line that it should."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAMS[number]], cwd=ROOT, capture_output=True, text=True, timeout=110, check=False
    )
    assert done.stderr == ""
    assert done.stdout.splitlines()[-1] == says


def test_the_readme_begins_with_the_two_commands() -> None:
    """A stranger finds ``make run`` and ``make test`` before anything else."""
    first = re.findall(r"^(make \w+)", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert first[:2] == ["make run", "make test"]
