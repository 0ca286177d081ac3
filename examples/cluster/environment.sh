# Read by the scripts beside it: the environment of a job. Change it to what your
# cluster has.

# Where boidsweep is installed: python3 -m venv ~/boidsweep, and pip install in it.
VENV=${VENV:-$HOME/boidsweep}
. "$VENV/bin/activate"

# Compiled kernels. Nodes differ in their processors, and a shared home folder is slow:
# so each node has its own folder, which only you can write, and keeps it for later jobs.
export NUMBA_CACHE_DIR=${NUMBA_CACHE_DIR:-/tmp/boidsweep-$(id -u)}
(umask 077 && mkdir -p "$NUMBA_CACHE_DIR")

# One thread a worker: trials run side by side, and not on several cores each.
export NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1

# Nothing of the folder in which the job starts runs as code.
export PYTHONSAFEPATH=1
