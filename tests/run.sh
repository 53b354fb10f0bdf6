#!/usr/bin/env bash
# Installs the packages that the tests need, builds, runs the suites and ends with: N passed, M failed, K skipped.
#
#   ./tests/run.sh                  a release build and its tests
#   ./tests/run.sh --sanitizers     also the benchmarks' own tests, ThreadSanitizer, AddressSanitizer with UBSan, and
#                                   each fuzz target for 5 s
#   ./tests/run.sh --only asan      one suite: release, tsan or asan
#   ./tests/run.sh --long           also the sanitizers, the tests labelled long, clang-tidy, the container, and all
#                                   attacks with their times; each fuzz target for 60 s
#   ./tests/run.sh --jobs 8         compile and test with 8 jobs (default: one a processor)
#
# Exits 0 only if nothing failed. A suite that cannot be installed, configured or built counts as one failure.
set -uo pipefail
cd "$(dirname "$0")/.." || exit
exec < /dev/null

suites=release
long=no
bench=no
jobs=$(nproc)
while [ $# -gt 0 ]; do
  case "$1" in
    --sanitizers) suites="release tsan asan"; bench=yes ;;
    --only) suites=${2-}; shift ;;
    --jobs) jobs=${2-}; shift ;;
    --long) suites="release tsan asan"; bench=yes; long=yes ;;
    -h | --help) sed -n '2,12s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "run.sh: unknown option $1; see --help" >&2; exit 2 ;;
  esac
  shift || true
done
case "$suites" in
  release | tsan | asan | "release tsan asan") ;;
  *) echo "run.sh: --only takes release, tsan or asan, not '$suites'" >&2; exit 2 ;;
esac
case "$jobs" in
  "" | 0 | *[!0-9]*) echo "run.sh: --jobs takes a number above zero, not '$jobs'" >&2; exit 2 ;;
esac

passed=0
failed=0
skipped=0
problems=()
skips=()
tested=()
started=$SECONDS

say() { printf '\n== [%4d s] %s\n' $((SECONDS - started)) "$*"; }

fail() {
  failed=$((failed + 1))
  problems+=("$*")
}

finish() {
  say "summary"
  for skip in ${skips[@]+"${skips[@]}"}; do echo "skipped: $skip"; done
  for suite in ${tested[@]+"${tested[@]}"}; do
    if [ -f "build/$suite/results.xml" ]; then
      /usr/bin/python3 tests/house/read_results.py --failures "build/$suite/results.xml"
    fi
  done
  for problem in ${problems[@]+"${problems[@]}"}; do echo "FAILED: $problem"; done
  echo "$passed passed, $failed failed, $skipped skipped"
  [ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
  exit
}

# Counts the results on standard input. Each line is `passed`, `skipped` or `failed`, and a name.
count_lines() {
  local suite=$1 kind name
  while read -r kind name; do
    case "$kind" in
      passed) passed=$((passed + 1)) ;;
      skipped) skipped=$((skipped + 1)); skips+=("$suite: $name") ;;
      failed) fail "$suite: $name" ;;
    esac
  done
}

# Counts the results in ctest's file.
count_results() {
  count_lines "$1" < <(/usr/bin/python3 tests/house/read_results.py "build/$1/results.xml" || echo "failed no readable results")
}

# Runs container.sh and counts its results. A script that ends early is a failure.
run_container() {
  say "container"
  ./tests/container.sh || true
  if ! tail -n 1 build/container/results.txt | grep -q "^ended"; then fail "container: did not come to its end"; fi
  count_lines container < build/container/results.txt
}

# Runs all attacks through each front and with each memory limit, and counts each front as one result. Times are checked
# only for the fronts mtls-stranger and edge, which keep strangers from gRPC: through plain and mtls, rapid resets delay
# the victim.
run_attacks() {
  local front rows
  mkdir -p build/attacks
  for front in plain mtls mtls-stranger edge; do
    say "attacks: $front"
    case $front in plain | mtls) rows=quick ;; *) rows=all ;; esac
    /usr/bin/python3 -B tests/attack/attack.py --attack "$rows" --limit 512MiB,1GiB,2GiB --front "$front" \
      --locusd build/release/bin/locusd --json "build/attacks/$front.json"
    case $? in
      0) passed=$((passed + 1)) ;;
      77) skipped=$((skipped + 1)); skips+=("attacks: $front") ;;
      *) fail "attacks: $front" ;;
    esac
  done
}

# Runs each fuzz target for a number of seconds and counts the results.
run_fuzz() {
  say "fuzz"
  ./tests/fuzz/run_targets.sh "$1" "$jobs" || true
  if ! tail -n 1 build/fuzz/results.txt | grep -q "^ended"; then fail "fuzz: did not come to its end"; fi
  count_lines fuzz < build/fuzz/results.txt
}

# ThreadSanitizer of GCC 12 fails if the kernel randomises more address bits than ThreadSanitizer supports.
steady_addresses=()
if setarch "$(uname -m)" -R true 2> /dev/null; then steady_addresses=(setarch "$(uname -m)" -R); fi

run_suite() {
  local suite=$1 wrapper=() labels=(-LE long)
  if [ "$suite" = tsan ]; then wrapper=(${steady_addresses[@]+"${steady_addresses[@]}"}); fi
  local options=(-DLOCUS_TESTS=ON -DLOCUS_PYTHON=ON)
  # clang-tidy checks each file separately.
  if [ "$long" = yes ]; then options+=(-DLOCUS_UNITY=OFF); fi
  if [ "$suite" = release ]; then options+=(-DLOCUS_BENCH=$([ "$bench" = yes ] && echo ON || echo OFF)); fi
  if [ "$suite" = release ] && [ "$long" = yes ]; then labels=(); fi
  # Compiling the whole command line with AddressSanitizer takes half an hour, so only the long run does this. Every
  # run with AddressSanitizer tests the file importers of the command line.
  if [ "$suite" = asan ] && [ "$long" = yes ]; then options+=(-DLOCUS_CLI=ON); fi
  say "$suite: configure"
  cmake --preset "$suite" "${options[@]}" || { fail "$suite: configure"; return; }
  say "$suite: build"
  cmake --build --preset "$suite" --parallel "$jobs" || { fail "$suite: build"; return; }
  say "$suite: test"
  rm -f "build/$suite/results.xml"
  ${wrapper[@]+"${wrapper[@]}"} ctest --preset "$suite" ${labels[@]+"${labels[@]}"} --parallel "$jobs" --no-tests=error \
    --test-output-size-passed 65536 --test-output-truncation head --output-junit "$PWD/build/$suite/results.xml" ||
    echo "run.sh: ctest of $suite exited with $?"
  # Prints the result of each proof.
  grep -h '^proof: ' "build/$suite/Testing/Temporary/LastTest.log" || true
  count_results "$suite"
  tested+=("$suite")
}

say "packages"
sets=(build python test)
if [ "$bench" = yes ]; then sets+=(bench); fi
case "$suites" in *asan*) sets+=(clang) ;; esac
case "$suites" in *release*) sets+=(package docs manifests) ;; esac
if [ "$long" = yes ]; then sets+=(lint cluster); fi
./deploy/packages.sh "${sets[@]}" || { fail "install packages"; finish; }

# In its depend mode, ccache does not preprocess each file before it compiles the file. That saves a tenth of a cold build.
export CCACHE_DEPEND=1
export UBSAN_OPTIONS="print_stacktrace=1:${UBSAN_OPTIONS-}"
# OpenSSL frees what it keeps for a thread when the thread ends, and threads of gRPC may outlive a test by a moment.
mkdir -p build
echo "leak:libcrypto.so" > build/suppressed_leaks.txt
export LSAN_OPTIONS="suppressions=$PWD/build/suppressed_leaks.txt:print_suppressions=0:${LSAN_OPTIONS-}"
for suite in $suites; do run_suite "$suite"; done
case "$suites" in *" asan"*) run_fuzz "$([ "$long" = yes ] && echo 60 || echo 5)" ;; esac
case "$long $suites" in
  "yes release"*)
    say "clang-tidy"
    if /usr/bin/python3 tests/house/tidy.py build/release --jobs "$jobs"; then passed=$((passed + 1)); else fail "clang-tidy"; fi
    run_container
    run_attacks
    ;;
esac
finish
