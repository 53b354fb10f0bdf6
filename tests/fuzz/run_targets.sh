#!/usr/bin/env bash
# Builds the fuzz targets and runs each for some seconds: tests/fuzz/run_targets.sh SECONDS JOBS
#
# Writes one line for each target (passed, failed or skipped, and its name) to build/fuzz/results.txt, and `ended` as
# the last line. Inputs that fail are left in build/fuzz/found. Without clang-16 and its fuzzer runtime, all targets are
# skipped.
set -uo pipefail
cd "$(dirname "$0")/../.." || exit
seconds=${1:?} jobs=${2:?}
results=build/fuzz/results.txt
mkdir -p build/fuzz/found build/fuzz/logs
: > "$results"

if ! echo 'extern "C" int LLVMFuzzerTestOneInput(const char*, unsigned long) { return 0; }' |
  clang++-16 -fsanitize=fuzzer -x c++ - -o build/fuzz/probe 2> /dev/null; then
  echo "skipped fuzz: clang-16 with libclang-rt-16-dev is not installed" >> "$results"
  echo ended >> "$results"
  exit
fi
if ! { cmake --preset fuzz && cmake --build --preset fuzz --parallel "$jobs"; }; then
  echo "failed fuzz build" >> "$results"
  echo ended >> "$results"
  exit 1
fi

run_target() {
  local target=$1 seconds=$2 corpus=build/fuzz/corpus/$1
  mkdir -p "$corpus"
  if timeout $((seconds + 120)) build/fuzz/bin/fuzz --target="$target" -max_total_time="$seconds" -max_len=65536 \
    -timeout=60 -rss_limit_mb=4096 -artifact_prefix="build/fuzz/found/$target-" \
    "$corpus" "tests/fuzz/seeds/$target" > "build/fuzz/logs/$target.txt" 2>&1; then
    echo "passed fuzz $target"
  else
    tail -n 40 "build/fuzz/logs/$target.txt" >&2
    echo "failed fuzz $target"
  fi
}
export -f run_target
# shellcheck disable=SC2016  # $1 and $2 are arguments of the inner shell
find tests/fuzz/seeds -mindepth 1 -maxdepth 1 -type d -printf '%f\n' | sort |
  xargs -P "$jobs" -I '{}' bash -c 'run_target "$1" "$2"' _ '{}' "$seconds" >> "$results"
sort -o "$results" "$results"
echo ended >> "$results"
! grep -q '^failed' "$results"
