"""The artificial recording, and the script that makes it."""

from pathlib import Path

from examples.school import main
from tests import ROOT


def test_the_script_makes_the_recording(tmp_path: Path) -> None:
    main(str(tmp_path / "school.csv"))
    made = (tmp_path / "school.csv").read_bytes()
    assert made == (ROOT / "examples" / "school.csv").read_bytes()
