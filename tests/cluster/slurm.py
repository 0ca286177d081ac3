"""Slurm on this machine, as far as scripts notice: `sbatch` and `srun` as programs.

`sbatch` reads the lines #SBATCH of a script and its own options, and runs a copy of the
script, from another folder, once for each task of an array, with the variables that
Slurm sets. `srun` runs a command once for each task of a job.
"""

import os
import subprocess
import sys
from pathlib import Path

from tests.patience import PATIENCE

SBATCH = """#!{python}
import os, re, shutil, subprocess, sys, tempfile
from pathlib import Path

options, arguments = {{}}, sys.argv[1:]
while arguments[0].startswith("--"):
    name, _, value = arguments.pop(0)[2:].partition("=")
    options[name] = value
script, *given = arguments
lines = Path(script).read_text(encoding="utf-8").splitlines()
lines = [line.split()[1][2:] for line in lines if line.startswith("#SBATCH")]
asked = [line.partition("=") for line in lines]
told = {{name: value for name, _, value in asked}} | options
spool = Path(tempfile.mkdtemp(dir={spool!r})) / "slurm_script"
shutil.copy(script, spool)
nodes, each = int(told.get("nodes", 1)), int(told.get("ntasks-per-node", 1))
variables = {{
    "SLURM_JOB_ID": "7",
    "SLURM_SUBMIT_DIR": os.getcwd(),
    "SLURM_NTASKS": str(nodes * each),
    "SLURM_CPUS_PER_TASK": told["cpus-per-task"],
}}
first, last = 0, 0
if "array" in told:
    first, last = map(int, re.fullmatch(r"([0-9]+)-([0-9]+)", told["array"]).groups())
codes = []
for task in range(first, last + 1):
    if "array" in told:
        variables["SLURM_ARRAY_JOB_ID"] = "7"
        variables["SLURM_ARRAY_TASK_ID"] = str(task)
        variables["SLURM_ARRAY_TASK_COUNT"] = str(last - first + 1)
    log = told["output"].replace("%x", told["job-name"]).replace("%a", str(task))
    log = log.replace("%A", "7").replace("%j", "7")
    with open(log, "wb") as file:  # as Slurm: its folder must be there
        codes.append(subprocess.run(
            ["bash", str(spool), *given],
            env=os.environ | variables, stdout=file, stderr=file,
        ).returncode)
sys.exit(max(codes))
"""
SRUN = """#!{python}
import os, subprocess, sys
tasks = [subprocess.Popen(sys.argv[1:]) for _ in range(int(os.environ["SLURM_NTASKS"]))]
sys.exit(max(task.wait() for task in tasks))
"""


def submit(
    folder: Path, script: Path, *arguments: str, **variables: str
) -> "subprocess.CompletedProcess[str]":
    """The finished `sbatch` of a script, called in `folder`."""
    programs, spool = folder / "programs", folder / "spool"
    for made in (programs, spool):
        made.mkdir()
    for name, text in (("sbatch", SBATCH), ("srun", SRUN)):
        program = programs / name
        program.write_text(
            text.format(python=sys.executable, spool=str(spool)), encoding="utf-8"
        )
        program.chmod(0o755)
    options = [one for one in arguments if one.startswith("--")]
    given = [one for one in arguments if one not in options]
    paths = {"PATH": f"{programs}:{os.environ['PATH']}"}
    return subprocess.run(
        ["sbatch", *options, script.name, *given],
        cwd=folder,
        env=os.environ | paths | variables,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
