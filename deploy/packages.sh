#!/bin/sh
# Installs the Debian packages that locus needs and that are missing. Safe to run again: if nothing is missing, the
# script needs neither network nor root rights.
# shellcheck disable=SC2086  # lists of package names are meant to be split
set -eu

usage() {
  cat <<'TEXT'
usage: deploy/packages.sh [--list|--check] SET...

sets:
  build      packages for configuring and building locusd and locus
  python     packages for building and using the Python package
  test       packages that tests/run.sh needs in addition to build
  bench      the libraries and servers that build/release/bin/locus-bench compares with, and gnuplot
  clang      the compiler of the asan preset and its sanitizers
  lint       packages that tests/run.sh --long needs in addition to these
  container  packages that tests/container.sh needs to build and run the image without a registry or a daemon
  package    packages that deploy/package.sh and the test of its packages need in addition to build and python
  runtime    libraries that locusd and locus need at run time; the image has nothing else
  edge       the front of deploy/edge
  cluster    the engine of deploy/cluster in plain processes: PostgreSQL with Patroni, etcd, and the proxy before locusd
  manifests  Node.js, and from npm the models that check the manifests of deploy/kubernetes
  docs       packages that build the pages of deploy/docs and check their links and spelling

  --list    print the names of the packages and do nothing
  --check   print the names of the missing packages; exit 1 if there is one
TEXT
}

# The compiler and the libraries that find_package and pkg-config look for.
build_packages="g++ cmake ninja-build pkg-config libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc
  libabsl-dev libspdlog-dev libcli11-dev nlohmann-json3-dev libassimp-dev libzip-dev libpng-dev libssl-dev
  prometheus-cpp-dev libboost-dev zlib1g-dev libcurl4-openssl-dev librocksdb-dev libpq-dev libxxhash-dev librhonabwy-dev libjansson-dev
  libseccomp-dev liblua5.4-dev libedit-dev"
python_packages="python3 python3-grpcio python3-protobuf"
# Purposes: ccache speeds up later builds; binutils provides nm for tests/house; prometheus-client and yaml read the
# metrics, alerts and dashboards; zsh and fish run the completions; groff and mandoc format the manual; tests run
# haproxy as a plain proxy and as the reverse proxy of deploy/edge; tests/attack uses python3-h2 for HTTP/2 and openssl
# for certificates; the test of deploy/security connects two namespaces with iproute2; tests/cluster starts three nodes of
# postgresql-15 and writes to them by python3-psycopg2.
test_packages="libgtest-dev libgmock-dev ccache clang-format git python3 binutils python3-numpy
  python3-prometheus-client python3-yaml python3-h2 openssl zsh fish mandoc groff-base haproxy iproute2
  postgresql-15 python3-psycopg2"
# redis-tools also contains the server, but unlike redis-server it starts no service; gnuplot draws the pictures of --plot.
bench_packages="libembree-dev libbullet-dev libcgal-dev libnanoflann-dev redis-tools gnuplot-nox"
# The compiler of the asan preset, and the libraries of its sanitizers.
clang_packages="clang-16 libclang-rt-16-dev"
lint_packages="clang-tidy mypy"
# systemd contains systemd-analyze, which checks the unit; iptables and containernetworking-plugins publish ports; catatonit
# is the first process of a pod; python3-yaml makes of the manifest what podman can play.
container_packages="mmdebstrap buildah podman podman-compose runc iptables containernetworking-plugins systemd catatonit
  python3-yaml"
# Purposes: debhelper, dh-python and dpkg-dev pack; lintian checks the packages, and diffoscope compares two of them;
# mmdebstrap makes the root they are installed in; runc runs that root with systemd as its first process; systemd contains
# systemd-analyze, which checks the unit; binutils lists the libraries of programs for deploy/sbom.py.
package_packages="debhelper dh-python dpkg-dev cmake lintian diffoscope-minimal mmdebstrap runc systemd binutils"
# The libraries that the programs link directly; apt installs the dependencies of these libraries.
runtime_packages="libgrpc++1.51 libprotobuf32 libabsl20220623 libspdlog1.10 libassimp5 libzip4 libpng16-16 libssl3 libstdc++6
  libprometheus-cpp-core1.0 zlib1g libcurl4 librocksdb7.8 libpq5 libxxhash0 librhonabwy1.1 libjansson4 libseccomp2
  liblua5.4-0 libedit2"
# The reverse proxy of deploy/edge.
edge_packages="haproxy"
# What deploy/cluster runs in containers, and its test in plain processes; python3-psycopg2 writes to PostgreSQL in the test.
cluster_packages="patroni python3-etcd etcd-server haproxy postgresql-15 python3-psycopg2 python3-yaml"
# The manifests are read by python3-yaml. Node.js of another source contains npm, with which Debian's npm conflicts.
manifests_packages="python3-yaml"
if ! command -v node >/dev/null || ! command -v npm >/dev/null; then manifests_packages="$manifests_packages nodejs npm"; fi
# Pages are run by python3-yaml and procps besides the packages of the sets build, python and test.
docs_packages="mkdocs mkdocs-material python3-yaml python3-pymdownx python3-prometheus-client linkchecker codespell
  procps protobuf-compiler"

# The folder in which npm installs the models, whose versions are pinned there, and the list of what is installed.
models_folder=$(dirname "$0")/../tests/deploy/kubernetes
models_installed=$models_folder/node_modules/installed-package-lock.json

# Installs the models for the set `manifests`, unless they were installed since their versions were changed last.
install_models() {
  [ "$models" = yes ] && [ "$action" = install ] || return 0
  cmp -s "$models_folder/package-lock.json" "$models_installed" && return 0
  echo "packages.sh: installing the models of Kubernetes' objects by npm"
  npm ci --prefix "$models_folder" --ignore-scripts --no-audit --no-fund --loglevel error </dev/null
  cp "$models_folder/package-lock.json" "$models_installed"
}

# Prints the services that a package starts when it is installed and at each boot. The tests, compose files and units of
# locus start these programs themselves.
services_of() {
  case $1 in
    haproxy) echo haproxy.service ;;
    etcd-server) echo etcd.service ;;
    patroni) echo patroni.service ;;
    podman) echo podman.socket podman.service podman-restart.service podman-auto-update.timer podman-auto-update.service ;;
  esac
}

action=install
packages=
models=no
for argument in "$@"; do
  case $argument in
    build) packages="$packages $build_packages" ;;
    python) packages="$packages $python_packages" ;;
    test) packages="$packages $test_packages" ;;
    bench) packages="$packages $bench_packages" ;;
    clang) packages="$packages $clang_packages" ;;
    lint) packages="$packages $lint_packages" ;;
    container) packages="$packages $container_packages" ;;
    package) packages="$packages $package_packages" ;;
    runtime) packages="$packages $runtime_packages" ;;
    edge) packages="$packages $edge_packages" ;;
    cluster) packages="$packages $cluster_packages" ;;
    manifests) packages="$packages $manifests_packages"; models=yes ;;
    docs) packages="$packages $docs_packages" ;;
    --list) action=list ;;
    --check) action=check ;;
    -h | --help) usage; exit 0 ;;
    *) echo "packages.sh: unknown argument '$argument'" >&2; usage >&2; exit 2 ;;
  esac
done
if [ -z "$packages" ]; then
  usage >&2
  exit 2
fi
if [ "$action" = list ]; then
  printf '%s\n' $packages
  exit 0
fi
if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "packages.sh: this is no Debian system; install the counterparts of:" $packages >&2
  exit 1
fi

missing=
for package in $packages; do
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)
  case $status in
    installed*) ;;
    *) missing="$missing $package" ;;
  esac
done
if [ -z "$missing" ]; then
  install_models
  exit 0
fi
if [ "$action" = check ]; then
  printf '%s\n' $missing
  exit 1
fi

if [ "$(id -u)" -eq 0 ]; then
  as_root=
elif command -v sudo >/dev/null; then
  as_root=sudo
else
  echo "packages.sh: neither root nor sudo is at hand. As root, run: apt-get install --no-install-recommends$missing" >&2
  exit 1
fi
echo "packages.sh: installing$missing"
$as_root env DEBIAN_FRONTEND=noninteractive apt-get update -q </dev/null
# Files that keep the packages from starting services during the installation. They are removed again, so that they do not
# concern packages and databases that the user installs later.
temporary=
trap '[ -z "$temporary" ] || $as_root rm -f $temporary' EXIT
trap 'exit 130' INT TERM HUP
# Debian's postgresql-15 makes and starts a database at its first installation, unless a file of createcluster.d
# (pg_createcluster(1)) forbids it. The tests need the programs only.
case " $missing " in
  *" postgresql-15 "*)
    no_database=/etc/postgresql-common/createcluster.d/locus-tests.conf
    temporary=$no_database
    $as_root mkdir -p "${no_database%/*}"
    echo "create_main_cluster = false" | $as_root tee "$no_database" >/dev/null
    ;;
esac
# Other packages start a service, unless policy-rc.d forbids it (invoke-rc.d(8)). A policy of the machine stays as it is.
services=
for package in $missing; do
  started=$(services_of "$package")
  services="$services${started:+ $started}"
done
policy=/usr/sbin/policy-rc.d
if [ -n "$services" ] && ! $as_root test -e "$policy"; then
  temporary="$temporary $policy"
  printf '#!/bin/sh\nexit 101\n' | $as_root tee "$policy" >/dev/null
  $as_root chmod 0755 "$policy"
fi
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $missing </dev/null
# Disable the new services, so that they do not start at the next boot either. `systemctl enable --now` starts them.
if command -v systemctl >/dev/null; then
  for service in $services; do
    $as_root systemctl --quiet disable "$service" >/dev/null 2>&1 || echo "packages.sh: $service was not disabled" >&2
  done
fi
install_models
