#!/bin/sh
# Draws the pictures of the pages about performance, and the one of core/index, from the results in this folder, and writes
# the figures into the pages. Needs a build of locus-bench and the package gnuplot-nox.
#
#   deploy/docs/performance-results/draw.sh                  with build/release/bin/locus-bench
#   deploy/docs/performance-results/draw.sh --bench PROGRAM  with another one
#   deploy/docs/performance-results/draw.sh --top FOLDER     writes below FOLDER instead of the project's root
set -eu
here=$(cd "$(dirname "$0")" && pwd)
source=$(cd "$here/../../.." && pwd)
bench=$source/build/release/bin/locus-bench
top=$source
while [ $# -gt 0 ]; do
  case $1 in
    --bench | --top)
      [ $# -ge 2 ] || { echo "draw.sh: $1 takes a value" >&2; exit 2; }
      case $1 in --bench) bench=$2 ;; --top) top=$2 ;; esac
      shift ;;
    -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "draw.sh: unknown option $1; see --help" >&2; exit 2 ;;
  esac
  shift
done
pages=$top/deploy/docs/pages/performance
mkdir -p "$pages"
for suite in static dynamic serving; do
  if [ -f "$here/$suite.json" ]; then "$bench" --from "$here/$suite.json" --plot "$pages"; fi
done
# Of the structures, only the growth of times is shown: their ratios to a list are in the table of core/index/README.md.
if [ -f "$here/structures.json" ]; then
  drawn=$(mktemp -d)
  trap 'rm -r "$drawn"' EXIT
  "$bench" --from "$here/structures.json" --plot "$drawn"
  mkdir -p "$top/core/index"
  for folder in "$pages" "$top/core/index"; do cp "$drawn/structures-growth.svg" "$folder"; done
fi
/usr/bin/python3 -B "$here/sizing.py" --draw "$pages"
