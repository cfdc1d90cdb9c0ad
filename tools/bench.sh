#!/bin/sh
# Runs every benchmark that is built in a build folder.
#
#     tools/bench.sh build/release
set -eu

found=0
for program in "$1"/benchmarks/*_bench "$1"/benchmarks/*/*_bench; do
  if [ -x "$program" ]; then
    found=1
    echo "== $program"
    "$program"
  fi
done
if [ $found = 0 ]; then
  echo "bench: no benchmarks in $1/benchmarks" >&2
  exit 1
fi
