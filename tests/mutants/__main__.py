"""Try the mutants of a sample, and print a table: `python -m tests.mutants`, or
`make mutants`. It takes hours. A run that was interrupted goes on where it was.
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path
from threading import Lock

from tests.mutants.copies import Copy, demand_no_changes, made, named
from tests.mutants.drawing import Mutant, drawn, modules
from tests.mutants.results import (
    FOLDER,
    OPEN,
    Result,
    append,
    equivalents,
    file_of,
    key,
    killers,
    stored,
    table,
)
from tests.mutants.trying import near, spread, together


def tried(mutants: Sequence[Mutant], revision: str, processes: int) -> None:
    """Try mutants, and store each result as it comes."""
    file = file_of(revision)
    earlier = killers(FOLDER)
    verdicts = {one.key: one.verdict for one in stored(file)}
    new = [one for one in mutants if key(one) not in verdicts]
    if not new and OPEN not in verdicts.values():
        return
    lock = Lock()

    def tell(result: Result) -> None:
        with lock:
            append(file, result)
            verdicts[result.key] = result.verdict
        about = f"{result.path}: {result.wrong}"
        print(f"{result.verdict:<9} {about}  {result.test}", flush=True)

    with tempfile.TemporaryDirectory(prefix="boidsweep-mutants-") as folder:
        places = [Path(folder, f"copy-{one}") for one in range(processes)]
        copies = [made(place, revision) for place in places]

        def one_near(copy: Copy, mutant: Mutant) -> None:
            tell(near(copy, mutant, earlier.get(key(mutant), "")))

        spread(copies, new, one_near)
        left = [one for one in mutants if verdicts[key(one)] == OPEN]
        together(copies, left, tell)
        for test in sorted({one for copy in copies for one in copy.unsound}):
            print(f"fails without any mistake, and was left out: {test}")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants")
    parser.add_argument("--list", action="store_true", help="print what is drawn")
    parser.add_argument("--table", action="store_true", help="print stored results")
    parser.add_argument("--tests", default="HEAD", help="the revision of the tests")
    parser.add_argument("--processes", type=int, default=1, choices=(1, 2))
    options = parser.parse_args()
    sample = drawn(modules())
    if options.list:
        print(*sample, sep="\n")
        return
    revision = named(options.tests)
    if not options.table:
        demand_no_changes()
        same = equivalents()
        mutants = [one for one in sample if key(one)[:3] not in same]
        tried(mutants, revision, options.processes)
    print(table(sample, stored(file_of(revision))))


if __name__ == "__main__":
    main()
