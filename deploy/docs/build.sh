#!/bin/sh
# Makes the pages that are generated, checks all pages, and builds the site. Needs a build of locus and the packages of
# `deploy/packages.sh build docs`.
#
#   deploy/docs/build.sh                    builds build/docs from build/release
#   deploy/docs/build.sh --build DIR        takes the programs of another build folder
#   deploy/docs/build.sh --site DIR         writes the site elsewhere
#   deploy/docs/build.sh --pages DIR        writes the pages in Markdown elsewhere (default: build/docs-pages)
#   deploy/docs/build.sh --pages-only       stops before mkdocs
set -eu
top=$(cd "$(dirname "$0")/../.." && pwd)
build=$top/build/release
site=$top/build/docs
pages=$top/build/docs-pages
pages_only=no
while [ $# -gt 0 ]; do
  case $1 in
    --build | --site | --pages)
      [ $# -ge 2 ] || { echo "build.sh: $1 takes a folder" >&2; exit 2; }
      folder=$(mkdir -p "$2" && cd "$2" && pwd)
      case $1 in --build) build=$folder ;; --site) site=$folder ;; --pages) pages=$folder ;; esac
      shift ;;
    --pages-only) pages_only=yes ;;
    -h | --help) sed -n '2,10s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) echo "build.sh: unknown option $1; see --help" >&2; exit 2 ;;
  esac
  shift
done
export PYTHONDONTWRITEBYTECODE=1
rm -rf "$pages"
mkdir -p "$pages"
cp -r "$top/deploy/docs/pages/." "$pages"
/usr/bin/python3 "$top/deploy/docs/include_files.py" --pages "$pages"
/usr/bin/python3 "$top/deploy/docs/reference.py" --source "$top" --build "$build" --pages "$pages/reference"
/usr/bin/python3 "$top/deploy/docs/check_pages.py" --pages "$pages"
[ "$pages_only" = no ] || exit 0
# The list of pages is made from the folders. The settings lie beside the pages, because mkdocs resolves folders from there.
settings=$pages.yml
/usr/bin/python3 "$top/deploy/docs/navigation.py" --settings "$top/deploy/docs/mkdocs.yml" --pages "$pages" --site "$site" >"$settings"
# Its messages matter only if it fails.
if ! mkdocs build --strict --clean --config-file "$settings" >"$pages.log" 2>&1; then
  grep -v "^INFO" "$pages.log" >&2
  exit 1
fi
# Removes what only a web server uses, or a developer of the theme. The site map also holds the day of the build, and equal
# pages are to give equal files.
rm -f "$site/sitemap.xml" "$site/sitemap.xml.gz" "$site/404.html"
find "$site" -name '*.map' -delete
echo "build.sh: $site/index.html"
