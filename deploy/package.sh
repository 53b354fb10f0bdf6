#!/usr/bin/env bash
# Packs locus for Debian 12: locusd, locus, liblocus-client-dev, python3-locus and, if deploy/docs has been built,
# locus-doc. Each package gets a list of what it ships and links (SPDX) beside it.
#
#   ./deploy/package.sh                        compiles everything, which takes long, and packs it
#   ./deploy/package.sh --from build/release   packs a finished build; needs no compiler
#
#   --out DIR          folder of the packages (default: build/package); its packages are replaced
#   --version VERSION  packs as another version than that of debian/changelog, for example 0.1.0+1
#   --docs DIR         folder of the built documentation (default: build/docs, if it exists)
#
# Installs missing Debian packages first, as root or with sudo. Packages of the same sources are equal byte for byte,
# whenever and wherever they are built.
set -euo pipefail
here=$PWD
cd "$(dirname "$0")/.."

from=
out=build/package
version=
docs=
while [ $# -gt 0 ]; do
  case "$1" in
    --from) from=$(cd "$here" && realpath -e "$2"); shift 2 ;;
    --out) out=$(cd "$here" && realpath -m "$2"); shift 2 ;;
    --version) version=$2; shift 2 ;;
    --docs) docs=$(cd "$here" && realpath -e "$2"); shift 2 ;;
    -h | --help) sed -n '2,14s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "package.sh: unknown option $1; see --help" >&2; exit 2 ;;
  esac
done
if [ -z "$docs" ] && [ -f build/docs/index.html ]; then docs=$PWD/build/docs; fi
if [ -n "$from" ] && [ ! -x "$from/bin/locusd" ]; then
  echo "package.sh: $from has no bin/locusd: build it first, or leave --from out" >&2
  exit 1
fi
umask 022
export LC_ALL=C.UTF-8

say() { printf '\n== %s\n' "$*"; }

say "packages needed"
if [ -n "$from" ]; then ./deploy/packages.sh package; else ./deploy/packages.sh build python package; fi

say "copy of the tree"
name=$(dpkg-parsechangelog --file deploy/debian/changelog --show-field Version)
mkdir -p "$out"
out=$(realpath "$out")
tree=$out/locus-$name
rm -rf "$tree" "$out"/compile_commands.json "$out"/*.deb "$out"/*.changes "$out"/*.buildinfo "$out"/*.spdx.json
mkdir "$tree"
# Lists the files of a clone, with uncommitted changes; an unpacked archive has only such files.
if [ "$(git rev-parse --show-toplevel 2> /dev/null)" = "$PWD" ]; then
  git ls-files -z --cached --others --exclude-standard
else
  find . \( -path ./build -o -path ./.git \) -prune -o -type f -print0
fi | while IFS= read -r -d '' file; do if [ -e "$file" ]; then printf '%s\0' "$file"; fi; done \
  | tar --create --null --files-from=- | tar --extract --directory="$tree" --no-same-owner
mv "$tree/deploy/debian" "$tree/debian"
if [ -n "$version" ]; then
  who=$(dpkg-parsechangelog --file "$tree/debian/changelog" --show-field Maintainer)
  when=$(dpkg-parsechangelog --file "$tree/debian/changelog" --show-field Date)
  { printf 'locus (%s) bookworm; urgency=medium\n\n  * Pack as version %s.\n\n -- %s  %s\n\n' "$version" "$version" "$who" "$when"
    cat deploy/debian/changelog; } > "$tree/debian/changelog"
fi
if [ -z "$docs" ]; then echo "no build/docs/index.html: locus-doc is left out; ./deploy/docs/build.sh makes the pages"; fi

say "pack"
check=()
# What is compiled already needs no libraries to compile with.
if [ -n "$from" ]; then check=(--no-check-builddeps); fi
(cd "$tree" && LOCUS_FROM=$from LOCUS_DOCS=$docs dpkg-buildpackage --build=binary --no-sign ${check[@]+"${check[@]}"})
# Keeps the compiler's command lines of a build that was compiled here.
find "$tree" -maxdepth 2 -path '*/obj-*/compile_commands.json' -exec mv -t "$out" {} +
rm -rf "$tree"

say "contents as SPDX"
for package in "$out"/*.deb; do
  /usr/bin/python3 -B deploy/sbom.py "$package" > "${package%.deb}.spdx.json"
done
ls -l "$out"
