"""Links in a stranger's results: no file is written, or read, at their other end."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from sweep.cli.progress import ProgressBar
from sweep.errors import StoreError
from sweep.published.publications import read_all
from sweep.published.reproducing import Outcome, reproduce
from sweep.store.store import Store
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests.cases import slow_but
from tests.commands import sweep
from tests.publications import experiments
from tests.studies import SMALL, launched, relaunch


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results with one small study."""
    results = tmp_path_factory.mktemp("whole") / "results"
    relaunch(SMALL, results)
    return results


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    """A copy of the results, and beside it a file and a folder of the user's."""
    shutil.copytree(whole, tmp_path / "results")
    (tmp_path / "mine").write_text("precious")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "curves.png").write_text("precious")
    return tmp_path


def untouched(folder: Path) -> bool:
    inside = [path.name for path in (folder / "elsewhere").rglob("*")]
    texts = [(folder / name).read_text() for name in ("mine", "elsewhere/curves.png")]
    return (inside, texts) == (["curves.png"], ["precious"] * 2)


@pytest.mark.parametrize(
    "ending", slow_but(["png.unfinished"], ["png", "png.unfinished", "svg"])
)
def test_figures_are_not_drawn_through_links_to_files(
    folder: Path, ending: str
) -> None:
    figures = folder / "results" / "small" / "figures"
    figures.mkdir()
    (figures / f"curves.{ending}").symlink_to(folder / "mine")
    done = sweep(
        folder, "plot", "small", "curves", "--format", "png", "--format", "svg"
    )
    assert (done.returncode, untouched(folder)) == (0, True)
    assert not (figures / "curves.png").is_symlink()
    assert (figures / "curves.png").read_bytes().startswith(b"\x89PNG")


def test_figures_are_not_drawn_into_a_folder_elsewhere(folder: Path) -> None:
    (folder / "results" / "small" / "figures").symlink_to(folder / "elsewhere")
    done = sweep(folder, "plot", "small", "curves")
    assert (done.returncode, untouched(folder)) == (2, True)
    assert "results/small/figures is a symbolic link" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_folder_that_the_user_names_may_be_a_link(folder: Path) -> None:
    (folder / "out").symlink_to(folder / "elsewhere")
    assert sweep(folder, "plot", "small", "curves", "--out", "out").returncode == 0
    assert (folder / "elsewhere" / "curves.png").read_bytes().startswith(b"\x89PNG")


def test_results_that_the_user_names_may_be_a_link(folder: Path) -> None:
    (folder / "named").symlink_to(folder / "results")
    relaunch(SMALL.replace("replicates: 3", "replicates: 4"), folder / "named")
    assert len(Store(folder / "results" / "small").trial_ids()) == 8
    assert (
        sweep(folder, "plot", "small", "curves", "--results", "named").returncode == 0
    )
    assert (folder / "results" / "small" / "figures" / "curves.png").exists()


ENDINGS = ("html", "md", "json")
"""Of the pages that a reproduction writes."""


def reproduced(folder: Path, *, quick: bool = False) -> Outcome:
    experiments(folder)
    publications = read_all(folder / "experiments", quick=quick)
    return reproduce(
        publications, folder / "results", Serial(), ProgressBar, quick=quick
    )


def test_the_page_is_not_written_through_a_link(folder: Path) -> None:
    pages = [folder / "results" / f"scorecard.{ending}" for ending in ENDINGS]
    for page in pages:
        page.symlink_to(folder / "mine")
    reproduced(folder)
    assert untouched(folder)
    assert all("tiny" in page.read_text() for page in pages)


@pytest.mark.parametrize(
    ("link", "quick"),
    [("figures", False), ("figures/tiny", False), ("quick/figures", True)],
)
def test_figures_of_publications_are_not_drawn_elsewhere(
    folder: Path, link: str, quick: bool
) -> None:
    place = folder / "results" / link
    place.parent.mkdir(exist_ok=True)
    place.symlink_to(folder / "elsewhere")
    outcome = reproduced(folder, quick=quick)
    said = [f"{link} is a symbolic link" in failure for failure in outcome.failures]
    # The picture of all claims lies beside the folder of a publication's own figures.
    assert said == [True] * (1 if link == "figures/tiny" else 2)
    assert untouched(folder)


def test_variants_are_not_read_through_a_link(folder: Path) -> None:
    (folder / "results" / "variants.json").symlink_to(folder / "mine")
    with pytest.raises(StoreError, match=r"variants.json: is a symbolic link"):
        reproduced(folder)
    assert untouched(folder)


def test_the_quick_page_is_not_written_elsewhere(folder: Path) -> None:
    (folder / "results" / "quick").symlink_to(folder / "elsewhere")
    with pytest.raises(StoreError, match=r"quick: is a symbolic link"):
        reproduced(folder, quick=True)
    assert untouched(folder)


LINKED = ["evil", "evil/deep", "evil/deep/x"]


@pytest.mark.parametrize("link", LINKED)
def test_no_folder_above_a_study_is_a_link(folder: Path, link: str) -> None:
    place = folder / "results" / link
    place.parent.mkdir(parents=True, exist_ok=True)
    place.symlink_to(folder / "elsewhere")
    with pytest.raises(
        StoreError,
        match=f"results/{link}: is a symbolic link; nothing is read or written outside",
    ):
        relaunch(
            SMALL.replace("study: small", "study: evil/deep/x"), folder / "results"
        )
    assert untouched(folder)


FILES = {
    "x.csv": ["export", "small", "--to"],
    "x.parquet": ["export", "small", "--to"],
    "x.arrow": ["export", "small", "--to"],
    "x.gif": ["replay", "small", "TRIAL", "--animate"],
    "x.html": ["replay", "small", "TRIAL", "--animate"],
    "x.png": ["replay", "small", "TRIAL", "--frame", "4"],
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_for_the_user_replaces_a_link_and_not_its_target(
    folder: Path, name: str
) -> None:
    [trial, *_] = Store(folder / "results" / "small").trial_ids()
    for beside in (name, f"{name}.sha256", f"{name}.json"):
        (folder / beside).symlink_to(folder / "mine")
    command = [trial if word == "TRIAL" else word for word in FILES[name]]
    done = sweep(folder, *command, name, "--force")
    assert (done.returncode, untouched(folder)) == (0, True)
    assert not (folder / name).is_symlink()
    assert (folder / name).stat().st_size > 100


def test_a_folder_of_parts_that_is_a_link_is_not_read(
    folder: Path, whole: Path
) -> None:
    shutil.rmtree(folder / "results" / "small" / "parts")
    (folder / "results" / "small" / "parts").symlink_to(whole / "small" / "parts")
    with pytest.raises(
        StoreError, match=r"parts: is a symbolic link; .* put the folder itself there"
    ):
        StoredStudy("small", folder / "results").statuses()


def a_part(folder: Path) -> Path:
    return next((folder / "results" / "small" / "parts").iterdir())


def test_a_part_that_is_a_link_is_not_read(folder: Path) -> None:
    part = a_part(folder)
    part.rename(folder / "elsewhere" / part.name)
    part.symlink_to(folder / "elsewhere" / part.name)
    with pytest.raises(
        StoreError,
        match=rf"{part.name}: is a symbolic link; .* put the folder itself there",
    ):
        StoredStudy("small", folder / "results").statuses()


@pytest.mark.parametrize("name", ["trials.parquet", "series.parquet", "manifest.json"])
def test_a_file_of_a_part_that_is_a_link_ends_a_launch_and_costs_nothing(
    folder: Path, name: str
) -> None:
    """As in a store that a tool for large files manages: its parts are sound, and stay
    where they are.
    """
    file = a_part(folder) / name
    file.rename(folder / "moved")
    file.symlink_to(folder / "moved")
    words = rf"{name}: cannot be read \(is a symbolic link, .*\); nothing was set aside"
    with pytest.raises(StoreError, match=words):
        relaunch(SMALL, folder / "results")
    file.unlink()
    (folder / "moved").rename(file)
    assert relaunch(SMALL, folder / "results").statuses.total() == 0


@pytest.mark.parametrize("name", ["plan.parquet", "trials.parquet", "series.parquet"])
def test_tables_are_not_read_through_links(folder: Path, name: str) -> None:
    place = folder / "results" / "small" if name == "plan.parquet" else a_part(folder)
    (place / name).rename(folder / "moved")
    (place / name).symlink_to(folder / "moved")
    with pytest.raises(StoreError, match=f"{name}: cannot be read .is a symbolic link"):
        _ = (
            StoredStudy("small", folder / "results").trials,
            Store(folder / "results" / "small").read("series"),
        )


def symlinked(place: Path, target: Path) -> None:
    place.symlink_to(target)


def hardlinked(place: Path, target: Path) -> None:
    os.link(target, place)


FLOWN = SMALL.replace("steps: 9", "steps: 30") + "checkpoint: 1.0e-9\n"


@pytest.fixture(scope="module")
def trials(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The trials of a study that keeps checkpoints."""
    clean = tmp_path_factory.mktemp("clean")
    return launched(FLOWN, clean).trials["trial_id"].tolist()


@pytest.mark.parametrize("ending", ["state", "tried-1", "tried-2", "frames"])
@pytest.mark.parametrize("linked", [symlinked, hardlinked])
def test_a_checkpoint_that_is_a_link_is_neither_read_nor_written(
    folder: Path, trials: list[str], ending: str, linked: Callable[[Path, Path], None]
) -> None:
    """Nor through a second name of a file, as some archives unpack them."""
    checkpoints = folder / "results" / "small" / "checkpoints"
    checkpoints.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sweep.trial.simulation.BOID_STEPS_A_CALL", 60)
        for trial in trials:
            linked(checkpoints / f"{trial}.{ending}", folder / "mine")
        assert relaunch(FLOWN, folder / "results").statuses == {"done": 6}
    assert untouched(folder)
