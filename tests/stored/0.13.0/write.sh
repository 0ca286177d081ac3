#!/bin/sh
# Writes studies/ and expected/ anew: sh write.sh SWEEP, the `sweep` of version 0.13.0.
# In a copy of this folder outside of any repository, whose state results would name.
set -eu
program=$(realpath "$1")
cd "$(dirname "$0")"

sweep() {
    "$program" "$@" --results studies
}

# Each table as CSV, which has the bits of every number.
tables() {
    study=$1
    shift
    mkdir -p "expected/$study"
    for table in "$@"; do
        sweep export "$study" --table "$table" --to "expected/$study/$table.csv"
    done
    rm expected/"$study"/*.csv.json expected/"$study"/*.csv.sha256
}

rm -rf studies expected

sweep launch specs/own.yaml --workers 1
tables own trials series trajectories
sweep table own --json > expected/own/table.json

sweep launch specs/ended.yaml --workers 1
tables ended trials series

sweep search specs/gains.yaml --workers 1
tables gains trials
sweep search specs/gains.yaml --workers 1 --json > expected/gains/search.json
