#!/bin/sh
# Measures everything that the pages about performance show, and draws the pictures: about ten minutes on two cores. Needs
# builds of locus-bench and of the Python package, and the packages of `deploy/packages.sh build python test bench`.
#
#   deploy/docs/performance-results/measure.sh [PART]...   structures, static, dynamic, serving, sizing (default: all)
set -eu
here=$(cd "$(dirname "$0")" && pwd)
source=$(cd "$here/../../.." && pwd)
cd "$source"
bin=build/release/bin
[ $# -gt 0 ] || set -- structures static dynamic serving sizing
plots=$(mktemp -d)
trap 'rm -r "$plots"' EXIT

# measure SUITE ARGUMENT...: runs a suite and keeps its results in this folder.
measure() {
  suite=$1
  "$bin/locus-bench" "$@" --rounds 5 --plot "$plots"
  cp "$plots/$suite.json" "$here/"
}

for part in "$@"; do
  case $part in
    structures)
      measure structures --filter '^((ball|ray)/.*/uniform/|(build|memory)/.*/uniform/1e5$|exponent/.*/uniform$)' ;;
    static)
      measure static --mesh terrain:270000 \
        --filter '^(ray/(incoherent|camera)/first|ball/2|box/2|build|memory|threads2)/' ;;
    dynamic)
      measure dynamic --filter '^(move|(ball|box|ray|nearest)_batch|insert|memory)/uniform/100k$|^rewind/.*/100k$|^compounds/.*/10k$' ;;
    serving)
      measure serving --filter '^(rays|moves|ball|tls|step)/|^moves_applied/4096' ;;
    sizing)
      PYTHONPATH=build/release/python /usr/bin/python3 -B "$here/sizing.py" --bin "$bin" ;;
    *) echo "measure.sh: unknown part $part" >&2; exit 2 ;;
  esac
done
"$here/draw.sh"
