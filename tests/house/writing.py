"""Every file that is written comes to be in one way: see sweep/store/new_files.py."""

import ast
from collections.abc import Iterator

from tests.house.sources import Checkout, Finding, Module, called, without_a_reason

WRITING = (
    *("sweep/**/*.py", "kernels/**/*.py", "experiments/**/*.py"),
    "notebooks/*.py",
)
CHANGING = {"O_WRONLY", "O_RDWR", "O_CREAT", "O_APPEND", "O_TRUNC"}
WRITERS = {
    *("write_text", "write_bytes", "touch", "symlink_to", "hardlink_to", "mkfifo"),
    *("savefig", "imsave", "imwrite", "save", "tofile", "savez", "savetxt"),
    *("to_csv", "to_parquet", "to_feather", "to_excel", "to_netcdf", "to_pickle"),
    *("ParquetWriter", "CSVWriter", "write_csv", "OSFile", "create_memory_map"),
    *(
        "NamedTemporaryFile",
        "TemporaryFile",
        "TemporaryDirectory",
        "mkstemp",
        "mkdtemp",
    ),
    *("mktemp", "shutil.copy", "copy2", "copyfile", "copytree", "fdopen", "FileIO"),
}
"""What can write to a path, or make a file."""

INTO_A_FILE = {
    "experiments/sheep/recording/convert.py to_parquet": "beside a spec, once",
    "experiments/vasarhelyi2018/winners.py to_csv": "into the repository",
    "sweep/explorer/widget.py savefig": "into memory",
    "sweep/figures/saving.py savefig": "into a file of `unfinished`",
    "sweep/replays/animation.py save": "into a file of `unfinished`",
    "sweep/sharing/packed_file.py open": "a member of a file of `unfinished`",
    "sweep/tables/exporting.py CSVWriter": "into a file of `unfinished`",
    "sweep/replays/video.py save": "into a file of `unfinished`",
    "sweep/store/parquet.py ParquetWriter": "into a file of `create` or `unfinished`",
    "sweep/web/export.py save": "into memory",
    "sweep/web/export.py savefig": "into memory",
    "sweep/web/replayed_page.py save": "our own, which is by `unfinished`",
    "sweep/published/drawings.py save": "our own, in sweep/figures/saving.py",
    "sweep/figures/kinds.py save": "our own, in sweep/figures/saving.py",
    "kernels/caching.py save": "our own, which numba writes into its cache",
}
OTHERWISE = {
    "sweep/store/new_files.py open": "this is the one place",
    "sweep/store/new_files.py fdopen": "this is the one place",
    "sweep/store/regular.py fdopen": (
        "reads, and opens what is there for `lock_files.py` and checkpoints"
    ),
    "sweep/workers/checkpoint_file.py open_regular": (
        "frames are added to a file, which may be no link"
    ),
    "sweep/store/lock_files.py open_regular": (
        "a claim of our own that must not come back once deleted"
    ),
    "sweep/trial/compiled.py TemporaryFile": (
        "a try whether numba can write in its folder"
    ),
    "sweep/trial/compiled.py mkdtemp": (
        "where kernels are compiled; nobody else may enter it"
    ),
    "sweep/store/user_key.py open": (
        "a key that must never be replaced: made exclusively"
    ),
    "sweep/store/user_key.py fdopen": "the same key",
    "sweep/store/user_key.py hardlink_to": ("the same key, which comes to be whole"),
    "sweep/explorer/drawn.py TemporaryDirectory": (
        "a file of a figure, which the page gets; nobody else may enter it"
    ),
    "sweep/web/export.py TemporaryFile": "a film for the page; it has no name",
    "sweep/workers/watch.py mkstemp": (
        "the board, which workers map: made exclusively, for us alone"
    ),
    "sweep/workers/watch.py fdopen": "the same board",
    "sweep/workers/watch.py open": "the same board, in a worker",
    "sweep/sharing/certificate.py TemporaryDirectory": (
        "a packed study, loaded for a comparison; the folder is deleted"
    ),
    "sweep/cli/supplementing.py TemporaryDirectory": (
        "trials of a page, which are stored nowhere else; the folder is deleted"
    ),
    "sweep/tables/outputs.py TemporaryDirectory": (
        "for programs that know paths only; nobody else may enter it"
    ),
    "sweep/store/buckets.py TemporaryDirectory": (
        "where parts are made up; nobody else may enter it"
    ),
    "sweep/tables/netcdf.py to_netcdf": "into that folder",
    "sweep/replays/video.py TemporaryDirectory": (
        "a folder of its own, for the metadata that ffmpeg reads"
    ),
    "sweep/replays/video.py write_text": "into that folder",
    "sweep/testing/compiled.py TemporaryDirectory": (
        "where the interpreter leaves its flights; nobody else may enter it"
    ),
    "sweep/testing/interpreted.py savez": "into that folder",
    "sweep/testing/offered.py TemporaryDirectory": (
        "where another process leaves its numbers; nobody else may enter it"
    ),
    "sweep/testing/given.py savez": "into that folder",
    "sweep/published/trying.py TemporaryDirectory": (
        "where a copy of the program lies that has a mistake; nobody else may enter it"
    ),
    "sweep/published/trying.py write_text": "into that folder",
    "sweep/published/program_mutants.py copytree": "into that folder",
    "sweep/published/program_mutants.py write_text": "into that folder",
    "sweep/published/headline.py write_text": (
        "README.md of a checkout, by `make documents`"
    ),
    "sweep/cli/output.py open": "os.devnull",
    "sweep/web/launching.py TemporaryFile": "has no name; what a launch says",
    "sweep/spec/images.py FileIO": "reads",
    "kernels/device/wasm.py TemporaryDirectory": (
        "for a linker that knows paths only; nobody else may enter it"
    ),
    "kernels/device/wasm.py write_bytes": "into that folder",
    "kernels/caching.py touch": "an empty file, whose name says all",
    "kernels/caching.py write_bytes": "beside its place, then renamed",
    "sweep/recordings/kept_frames.py mkdtemp": (
        "where frames are computed; nobody else may enter it"
    ),
    "sweep/recordings/tracks.py open": "a file of that folder, which gets its blocks",
    "sweep/recordings/recording.py write_text": "into that folder",
    "sweep/store/lock.py touch": "our own, which gives a claim the time of now",
    "notebooks/execute.py TemporaryDirectory": (
        "an empty folder in which a notebook runs"
    ),
    "notebooks/execute.py shutil.copy": "into that folder",
}


def _written(module: Module) -> Iterator[tuple[str, ast.Call]]:
    """The calls in a module that write a file, or could."""
    for node in module.nodes:
        if not isinstance(node, ast.Call):
            continue
        name = called(node)
        if name == "copy" and ast.unparse(node.func) == "shutil.copy":
            name = "shutil.copy"
        values = [*node.args, *(word.value for word in node.keywords)]
        texts = [
            one.value
            for one in values
            if isinstance(one, ast.Constant) and isinstance(one.value, str)
        ]
        inner = {
            one.attr
            for value in values
            for one in ast.walk(value)
            if isinstance(one, ast.Attribute)
        }
        names = {
            one.id
            for value in values
            for one in ast.walk(value)
            if isinstance(one, ast.Name)
        }
        modes = name == "open" and any(
            set(text) & set("wax+") and len(text) < 5 for text in texts
        )
        flags = name in ("open", "open_regular") and inner & CHANGING
        # os.open(path, FLAGS) with flags that are named elsewhere
        flagged = name == "open" and names & {"NEW"}
        as_text = name.startswith("to_") and not node.args
        if (name in WRITERS and not as_text) or modes or flags or flagged:
            yield name, node


def no_module_writes_a_file_in_a_way_of_its_own(
    checkout: Checkout,
) -> Iterator[Finding]:
    modules = map(checkout.module, checkout.files(*WRITING))
    reasons = INTO_A_FILE | OTHERWISE
    yield from without_a_reason(modules, _written, reasons, "writes a file by")


RULES = (no_module_writes_a_file_in_a_way_of_its_own,)
