#!/usr/bin/env bash
# Fetches the levels for locus-bench from Debian's packages into build/levels. Packages are downloaded and unpacked, but
# not installed. Safe to run again.
#
#   ./tests/bench/fetch_levels.sh
#
# Exits 1 if a level is not available; locus-bench then runs without that level and adds a note.
set -uo pipefail
cd "$(dirname "$0")/../.." || exit
levels=build/levels
mkdir -p "$levels"

# fetch PACKAGE FILE: fetches the file of that name from the package.
fetch() {
  local package=$1 file=$2 folder
  if [ -f "$levels/$file" ]; then return 0; fi
  folder=$(mktemp -d "$levels/fetch.XXXXXX")
  chmod 755 "$folder"
  (cd "$folder" && apt-get download "$package" && dpkg-deb -x ./*.deb unpacked) >> "$levels/fetch.log" 2>&1
  find "$folder" -name "$file" -exec mv {} "$levels/$file" \;
  rm -rf "$folder"
  if [ -f "$levels/$file" ]; then
    echo "$levels/$file, from Debian's package $package"
  else
    echo "the package $package could not be had: try apt-get update, and see $levels/fetch.log" >&2
    return 1
  fi
}

status=0
fetch openarena-081-maps pak1-maps.pk3 || status=1
fetch glmark2-data bunny.obj || status=1
exit $status
