"""What one operating system lacks is asked for where it is guarded, and text has the
same encoding on all.
"""

import ast
from collections.abc import Iterator

from tests.elsewhere import LACKS
from tests.house.sources import Checkout, Finding, Module, without_a_reason

NAMES = {name for names in LACKS.values() for name in names} - {"wait", "pause"} | {
    *("fsync", "fdatasync", "getppid", "kill", "umask", "link", "symlink", "readlink"),
    *("dir_fd", "src_dir_fd", "dst_dir_fd", "pass_fds", "preexec_fn", "tzset"),
    *("start_new_session", "resource_tracker", "SO_REUSEADDR", "AF_UNIX"),
}
"""What some system lacks, or does in a way of its own: of the standard library."""
LIBRARY = {"os", "signal", "socket", "multiprocessing"}
MEMBERS = {
    *("rename", "chmod", "symlink_to", "hardlink_to", "readlink", "mkfifo"),
    *("st_uid", "st_gid", "st_ino", "prctl", "CDLL", "F_FULLFSYNC"),
    *("NamedTemporaryFile", "add_signal_handler", "send_signal"),
}
"""The same, of whatever object."""
MODULES = {"fcntl", "pwd", "grp", "resource", "select", "termios", "pty", "syslog"}
PLACES = ("/proc", "/dev", "/tmp", "/etc", "/sys")
"""Names of files that only some systems have."""

GUARDED = {
    "sweep/store/durable.py O_DIRECTORY": "asked for before it is used",
    "sweep/store/durable.py F_FULLFSYNC": "of macOS alone",
    "sweep/store/durable.py fcntl": "of macOS alone",
    "sweep/store/durable.py fsync": "this is the one place",
    "sweep/store/new_files.py O_DIRECTORY": "asked for before it is used",
    "sweep/store/new_files.py O_NOFOLLOW": "where O_DIRECTORY is",
    "sweep/store/new_files.py dir_fd": "where O_DIRECTORY is; None elsewhere",
    "sweep/store/new_files.py src_dir_fd": "where O_DIRECTORY is",
    "sweep/store/new_files.py dst_dir_fd": "where O_DIRECTORY is",
    "sweep/store/new_files.py rename": "our own, which replaces what is there",
    "sweep/store/regular.py O_NOFOLLOW": "asked for; a link is looked for without",
    "sweep/store/regular.py O_NONBLOCK": "asked for; Windows has no pipes in folders",
    "sweep/store/user_key.py geteuid": "asked for before it is used",
    "sweep/store/user_key.py st_uid": "where geteuid is",
    "sweep/store/user_key.py hardlink_to": "NTFS has it; without it no key is kept",
    "sweep/store/lock_files.py rename": "to a name that is not there",
    "sweep/store/folders.py rename": "to a name that is not there",
    "sweep/store/processes.py getuid": "asked for before it is used",
    "sweep/store/processes.py SIGKILL": "asked for; on Linux after prctl",
    "sweep/store/processes.py kill": "this is the one place",
    "sweep/store/processes.py getppid": "on Linux alone",
    "sweep/store/processes.py prctl": "on Linux alone",
    "sweep/store/processes.py CDLL": "on Linux alone",
    "sweep/store/processes.py readlink": "of /proc, on Linux alone",
    "sweep/store/processes.py /proc": "on Linux alone",
    "sweep/store/memory.py CDLL": "on Linux alone",
    "sweep/store/repository.py /dev": "git knows it on every system",
    "sweep/analysis/intervals.py rename": "of pandas",
    "sweep/analysis/pooling.py rename": "of pandas",
    "sweep/store/whole_studies.py rename": "to a name that is not there",
    "sweep/methods/power/analysis.py rename": "of pandas",
    "sweep/tables/safe_csv.py rename": "of pandas",
    "sweep/tables/outputs.py /proc": "on Linux alone",
    "sweep/trial/interrupts.py SIGHUP": "asked for",
    "sweep/trial/interrupts.py pthread_sigmask": "asked for before it is used",
    "sweep/trial/interrupts.py SIG_BLOCK": "where pthread_sigmask is",
    "sweep/trial/interrupts.py SIG_SETMASK": "where pthread_sigmask is",
    "sweep/trial/compiled.py geteuid": "asked for before it is used",
    "sweep/trial/compiled.py st_uid": "where geteuid is",
    "sweep/trial/compiled.py st_gid": "where geteuid is",
    "sweep/trial/compiled.py chmod": "where geteuid is",
    "sweep/trial/compiled.py readlink": "where geteuid is",
    "sweep/trial/compiled.py grp": "where geteuid is",
    "sweep/trial/compiled.py pwd": "where geteuid is",
    "sweep/workers/executors.py resource_tracker": "where pthread_sigmask is",
    "sweep/workers/executors.py /dev": "elsewhere that folder is missing",
    "sweep/workers/executors.py sched_getaffinity": "asked for before it is used",
    "sweep/workers/remote.py start_new_session": "Windows takes and ignores it",
    "sweep/web/launching.py start_new_session": "Windows takes and ignores it",
    "sweep/cli/page_beside.py start_new_session": "Windows takes and ignores it",
    "sweep/web/server.py SO_REUSEADDR": "where SO_EXCLUSIVEADDRUSE is not",
}
"""Every use of such a name, and why it is no error elsewhere."""


def _names(node: ast.AST) -> set[str]:
    """What a node uses that some system lacks: names, modules and places."""
    match node:
        case ast.Attribute(value, attribute):
            library = isinstance(value, ast.Name) and value.id in LIBRARY
            return {attribute} & (MEMBERS | NAMES if library else MEMBERS)
        case ast.keyword(word):
            return {word} & NAMES
        case ast.Import(aliases) | ast.ImportFrom(names=aliases):
            names = {alias.name for alias in aliases}
            is_from = isinstance(node, ast.ImportFrom)
            origin = {node.module or ""} if is_from else names
            known = NAMES if origin <= LIBRARY else MEMBERS
            return (origin & MODULES) | (names & known)
        case ast.Constant(str(text)):
            places = {
                one for one in PLACES if text.startswith(one) or f"={one}" in text
            }
            return places | {text} & NAMES  # as in getattr(os, NAME)
    return set()


def _uses(module: Module) -> Iterator[tuple[str, ast.AST]]:
    return ((name, node) for node in module.nodes for name in _names(node))


def _as_text(module: Module) -> Iterator[ast.Call]:
    """Calls that read or write text in the encoding of the system."""
    for node in module.nodes:
        if not isinstance(node, ast.Call):
            continue
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        words = {word.arg for word in node.keywords}
        given = {"read_text": 1, "write_text": 2}.get(name, 99) <= len(node.args)
        whole = name in ("read_text", "write_text") and not given
        piped = "text" in words and ast.unparse(node.func).startswith("subprocess.")
        if (whole or piped) and "encoding" not in words:
            yield node


def what_a_system_lacks_is_asked_for_nowhere_else(
    checkout: Checkout,
) -> Iterator[Finding]:
    modules = checkout.modules.values()
    yield from without_a_reason(modules, _uses, GUARDED, "uses what some system lacks:")


def text_has_the_same_encoding_on_every_system(checkout: Checkout) -> Iterator[Finding]:
    for module in checkout.modules.values():
        for call in _as_text(module):
            yield module.finding(call, "text of an encoding that is not said")


RULES = (
    what_a_system_lacks_is_asked_for_nowhere_else,
    text_has_the_same_encoding_on_every_system,
)
