#!/usr/bin/env bash
# Sets up locusd on a fresh Debian 12 machine, with a real game level, and checks its answers by brute force.
#
#   ./deploy/quickstart.sh [--seconds N] [--objects N] [--keep]
#
# Installs missing Debian packages (as root or with sudo), builds Release into build/release, fetches a level, starts
# locusd on a free loopback port, and runs `locus demo`. The demo moves objects while clients query, and compares the
# answers of these queries with brute force. Then renders the scene to build/quickstart.png. Exits 1 on any difference.
# --keep leaves the daemon running.
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=5
objects=10000
keep=no
while [ $# -gt 0 ]; do
  case "$1" in
    --seconds) seconds=$2; shift 2 ;;
    --objects) objects=$2; shift 2 ;;
    --keep) keep=yes; shift ;;
    -h | --help) sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "quickstart: unknown option $1; see --help" >&2; exit 2 ;;
  esac
done

build=build/release
levels=build/levels
package=openarena-081-maps
entry=maps/delta.bsp

say() { printf '\n== %s\n' "$*"; }

missing=$(./deploy/packages.sh --check build python || true)
cat << TEXT
This runs locus on a real game level, in six steps:
  1 packages  installs $(wc -w <<< "$missing") of $(./deploy/packages.sh --list build python | wc -w) Debian packages (with all of them missing: about 1 GB on the disk, 1 minute)
  2 build     compiles locusd, locus and the Python package into $build (first time: about 3 minutes on 2 cores)
  3 level     downloads 40 MB of OpenArena's levels and unpacks one; nothing of it is installed
  4 - 6       start two daemons on loopback, check their answers by brute force for $seconds s, take a picture
Everything is below $(pwd)/build; deleting that folder undoes all but the packages.
TEXT

say "1/6 packages"
./deploy/packages.sh build python

say "2/6 build into $build"
export NINJA_STATUS="[%f of %t, %es] "
if [ ! -f "$build/build.ninja" ]; then
  cmake --preset release -DLOCUS_TESTS=OFF > build.log.$$ 2>&1 || { cat build.log.$$; rm -f build.log.$$; exit 1; }
  rm -f build.log.$$
fi
# Everything that `cmake --install` installs.
cmake --build "$build" --target locusd locus locus_embedded locus_python locus_completions locus_manual_pages

# Downloads and unpacks the package of the level, but does not install it.
download_level() {
  local work status=0
  work=$(mktemp -d "$levels/fetch.XXXXXX")
  chmod 755 "$work"
  (cd "$work" && apt-get download "$package" && dpkg-deb -x ./*.deb unpacked) >> "$levels/fetch.log" 2>&1 || status=1
  find "$work" -name pak1-maps.pk3 -exec mv {} "$levels/pak1-maps.pk3" \;
  rm -rf "$work"
  return $status
}

# Updates Debian's package lists once: on a fresh machine they do not contain the package yet.
update_lists() {
  local as_root=()
  [ "$(id -u)" = 0 ] || as_root=(sudo)
  "${as_root[@]}" apt-get update >> "$levels/fetch.log" 2>&1
}

fetch_level() {
  [ -f "$levels/pak1-maps.pk3" ] && return 0
  mkdir -p "$levels"
  : > "$levels/fetch.log"
  download_level || { update_lists && download_level; } || true
  [ -f "$levels/pak1-maps.pk3" ]
}

say "3/6 level"
level=()
camera=()
if fetch_level; then
  echo "OpenArena level $entry from Debian's package $package"
  level=("$levels/pak1-maps.pk3" --entry "$entry")
  camera=(--eye 1300,-1500,2000 --look-at 2250,700,560)
else
  echo "THE PACKAGE $package COULD NOT BE HAD (see $levels/fetch.log): USING THE GENERATED CITY, NOT A REAL LEVEL"
fi

say "4/6 start locusd"
run=$(mktemp -d)
pids=()
stop() {
  for pid in "${pids[@]}"; do kill -TERM "$pid" 2> /dev/null && wait "$pid" 2> /dev/null || true; done
  rm -rf "$run"
}
trap stop EXIT

# Starts a daemon with the given name and number of threads. Sets `address` to its address.
start() {
  local name=$1 threads=$2
  "$build/bin/locusd" --listen 127.0.0.1:0 --port-file "$run/$name.port" --threads "$threads" > "$run/$name.log" 2>&1 &
  pids+=($!)
  for _ in $(seq 100); do
    [ -s "$run/$name.port" ] && { address="127.0.0.1:$(cat "$run/$name.port")"; return 0; }
    kill -0 "${pids[-1]}" 2> /dev/null || break
    sleep 0.1
  done
  echo "locusd did not start:" >&2
  cat "$run/$name.log" >&2
  exit 1
}
start main 2
main=$address
start check 1
check=$address
echo "locusd at $main (2 threads), and at $check (1 thread) to compare with"

say "5/6 demo"
"$build/bin/locus" --address "$main" demo "${level[@]}" --objects "$objects" --seconds "$seconds" --compare "$check"

say "6/6 picture"
"$build/bin/locus" --address "$main" render demo build/quickstart.png --size 800x450 --samples 4 "${camera[@]}"
echo "the level with its moving objects, by four rays a pixel: build/quickstart.png"

cat << TEXT

All answers were correct. Try next:
  $build/bin/locusd                                  start a daemon on 127.0.0.1:7575
  $build/bin/locus scene create arena                make a scene
  $build/bin/locus import LEVEL --scene arena        put your own level in it (OBJ, PLY, STL, glTF, BSP, PK3)
  $build/bin/locus query ray arena --from 0,0,0 --dir 1,0,0
  $build/bin/locus --help
TEXT
if [ "$keep" = yes ]; then
  kill -TERM "${pids[1]}" && wait "${pids[1]}" || true
  trap - EXIT
  echo "locusd still runs at $main with scene 'demo'; stop it with: kill ${pids[0]}"
fi
