#!/usr/bin/env bash
# Builds the image of deploy/Dockerfile and tests a container of it. Needs root, but no registry and no Docker daemon:
# buildah builds the image on a base made from this machine's Debian sources, and podman runs it. Checks the systemd
# units, the manifest for Kubernetes, and both compose files too, that of deploy/edge with a token through the front. All
# files are in build/container; the next run uses them again.
#
#   ./tests/container.sh            ends with: N passed, M failed, K skipped
#   ./tests/container.sh --fresh    first removes the files of earlier runs
#
# Writes one line for each check (passed, failed or skipped, and its name) to build/container/results.txt, and `ended`
# as the last line.
# shellcheck disable=SC2016,SC2317  # $(ORIGIN) is for apt-get; functions are called through check
set -uo pipefail
cd "$(dirname "$0")/.." || exit
exec < /dev/null

store=$PWD/build/container
results=$store/results.txt
log=$store/log.txt
image=localhost/locus
edge_image=localhost/locus-edge
base=localhost/debian:12-slim

case "${1-}" in
  "") ;;
  --fresh) rm -rf "$store" ;;
  *) sed -n '2,11s/^# \{0,1\}//p' "$0"; [ "$1" = --help ]; exit ;;
esac
mkdir -p "$store" && : > "$results" && : > "$log" || exit

containers=()
composed=
manifest=
work=$(mktemp -d /tmp/locus-container.XXXXXX) || exit

clean_up() {
  compose_ends
  kube_ends
  for id in ${containers[@]+"${containers[@]}"}; do podman rm --force --volumes --time 1 "$id"; done
  rm -rf "$work"
} >> "$log" 2>&1
trap clean_up EXIT

finish() {
  echo ended >> "$results"
  printf '%s passed, %s failed, %s skipped\n' "$(grep -c ^passed "$results")" "$(grep -c ^failed "$results")" \
    "$(grep -c ^skipped "$results")"
  ! grep -q ^failed "$results" && grep -q ^passed "$results"
  exit
}

report() { echo "$1 $2" | tee -a "$results"; }

# check NAME COMMAND...: runs the command; the check passes if the command succeeds. The command's output goes to the
# log, and is also printed if the check fails.
check() {
  local name=$1 outcome=failed
  shift
  "$@" > "$work/output" 2>&1 && outcome=passed
  report $outcome "$name"
  [ $outcome = passed ] || tail -n 40 "$work/output" | sed 's/^/    /'
  { echo "--- $name: $outcome"; cat "$work/output"; } >> "$log"
}

skip() { report skipped "$1"; echo "    SKIP: $2"; }

# Runs a check on which the later checks depend: ends the script if it fails.
need() {
  local before
  before=$(grep -c ^failed "$results")
  check "$@"
  [ "$(grep -c ^failed "$results")" = "$before" ] || finish
}

# Gives podman storage and settings of its own. So that podman works inside a container, the settings select runc
# instead of crun, and contain only resource limits that a process without CAP_SYS_RESOURCE may set.
set_up_podman() {
  local driver=overlay
  [ "$(stat -f -c %T "$store")" = overlayfs ] && driver=vfs
  cat > "$work/containers.conf" << TEXT
[containers]
default_ulimits = ["nofile=8192:8192", "nproc=1024:1024"]
[engine]
runtime = "runc"
cgroup_manager = "cgroupfs"
events_logger = "file"
[network]
network_config_dir = "$work/networks"
TEXT
  cat > "$work/storage.conf" << TEXT
[storage]
driver = "$driver"
graphroot = "$store/storage"
runroot = "$work/run"
TEXT
  # Keeps the images of earlier runs, and removes podman's other state, which refers to folders that do not exist any
  # more.
  rm -rf "$store/storage/libpod"
  export CONTAINERS_CONF=$work/containers.conf CONTAINERS_STORAGE_CONF=$work/storage.conf
  podman info
}

# Builds a minimal Debian from the package sources of this machine's apt.
make_base() {
  if buildah inspect "$base" > /dev/null 2>&1; then echo "there already"; return 0; fi
  mkdir -p "$work/base"
  apt-get indextargets --format '$(ORIGIN) deb $(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' \
    | sed -n 's/^Debian deb/deb/p' | sort -u > "$work/base.list"
  mmdebstrap --variant=minbase bookworm "$work/base/rootfs.tar" "$work/base.list" || return
  printf 'FROM scratch\nADD rootfs.tar /\n' > "$work/base/Dockerfile"
  buildah build --isolation chroot --tag "$base" "$work/base"
}

build_image() {
  buildah build --isolation chroot --format docker --layers --build-arg BASE="$base" --file deploy/Dockerfile \
    --ignorefile deploy/Dockerfile.dockerignore --tag "$image" .
}
build_edge_image() {
  buildah build --isolation chroot --format docker --layers --build-arg BASE="$base" --tag "$edge_image" deploy/edge
}

# Starts a container that is hardened as in compose.yaml, with the given options. Sets `id` to the container's id and
# waits until the server in the container answers.
start() {
  # conmon writes a file to its working directory if the kernel kills a container that is out of memory.
  id=$(cd "$work" && podman run --detach --read-only --cap-drop all --security-opt no-new-privileges --env LOCUS_INSECURE=1 \
    --publish 127.0.0.1::7575 "$@" "$image") || return
  containers+=("$id")
  for _ in $(seq 100); do
    podman exec "$id" locus health && return
    sleep 0.2
  done
  podman logs "$id"
  return 1
}

# Runs a command in the container itself.
inside() { podman exec --interactive "$id" "$@"; }
# Runs a command in a second container, as a client through the port that is published on this machine's loopback.
client() {
  podman run --rm --interactive --network host --env LOCUS_ADDRESS="$(podman port "$id" 7575/tcp)" --entrypoint locus "$image" "$@"
}
# Runs podman-compose with the compose file of `composed`.
compose() {
  LOCUS_PORT=$compose_port LOCUS_HTTP_PORT=$compose_http_port LOCUS_EDGE_PORT=$edge_port LOCUS_ETC=$work/etc podman-compose \
    --project-name "$(basename "$work" | tr -d .)" --file "$composed" "$@"
}
# Removes the containers, volumes and network that compose has made.
compose_ends() {
  [ -n "$composed" ] || return 0
  compose down --volumes && podman network rm "$(basename "$work" | tr -d .)_default" && composed=
}

free_port() { /usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }
refuses_without_a_word() {
  local output code
  output=$(podman run --rm "$image" 2>&1)
  code=$?
  printf '%s\n' "$output"
  [ "$code" = 2 ] && grep -q LOCUS_INSECURE=1 <<< "$output" && grep -qF "listen on 127.0.0.1, [::1] or a unix socket" <<< "$output"
}
holds_no_tools() {
  podman run --rm --entrypoint sh "$image" -c '
    for tool in cc c++ gcc g++ ld make cmake ninja git python3 protoc; do command -v $tool && exit 1; done
    dpkg-query -W -f "\${Package}\n" | grep -E -- "-dev$|^(gcc|g[+][+]|cpp|clang)(-[0-9]+)?$" && exit 1; exit 0'
}
finds_its_libraries() {
  podman run --rm --entrypoint sh "$image" -c 'ldd /usr/local/bin/locusd /usr/local/bin/locus | grep "not found" && exit 1; exit 0'
}
runs_as_nobody_else() { [ "$(podman run --rm --entrypoint id "$image" -u):$(inside id -g)" = 10001:10001 ]; }
says_its_version() {
  local label
  label=$(podman image inspect --format '{{index .Labels "org.opencontainers.image.version"}}' "$image")
  [ "$(podman run --rm "$image" --version)" = "locusd $label" ]
}
root_is_read_only() { ! inside touch /file && inside touch /var/lib/locus/file; }
has_no_capability() { [ "$(inside sed -n 's/^Cap[A-Z][a-z]*:\t//p;s/^NoNewPrivs:\t//p' /proc/1/status | tr '\n' ' ')" = \
  "0000000000000000 0000000000000000 0000000000000000 0000000000000000 0000000000000000 1 " ]; }
is_healthy() { podman healthcheck run "$id"; }
started_with() { podman logs "$id" 2>&1 | grep " serving " | grep -w -- "$1"; }
lists_its_memory() { client -o ndjson limits | grep '"memory_bytes"' | grep -w 201326592; }
# Uploads a mesh whose tree exceeds the memory limit: the upload must be refused, and no data may be lost.
refuses_what_does_not_fit() {
  local output code
  client scene create full || return
  output=$(client generate city --triangles 3000000 --seed 1 --scene full 2>&1)
  code=$?
  printf '%s\n' "$output"
  [ "$code" != 0 ] && grep -q memory_bytes <<< "$output" && client scene describe full
}
answers_inside() { inside locus run - < "$1"; }
answers_outside() { client run - < "$1"; }
ends_in_order() {
  podman stop --time 20 "$id" && [ "$(podman inspect --format '{{.State.ExitCode}}' "$id")" = 0 ] \
    && podman logs "$id" 2>&1 | grep " ended"
}
http_ready() {
  # Without -q: grep would close the pipe before the program has written the end of the line.
  /usr/bin/python3 -c 'import sys, urllib.request as r; print(r.urlopen(sys.argv[1], timeout=10).read().decode())' \
    "http://127.0.0.1:$compose_http_port/readyz" | grep ready
}

compose_starts() {
  composed=deploy/compose.yaml
  compose up --detach || return
  for _ in $(seq 100); do
    podman run --rm --network host --env LOCUS_ADDRESS=127.0.0.1:"$compose_port" --entrypoint locus "$image" health && return
    sleep 0.2
  done
  return 1
}

# Runs a command of `locus` as root with the folder of the front's files, which it makes.
in_etc() { podman run --rm --user 0:10001 --volume "$work/etc:/etc/locus" --workdir /etc/locus --entrypoint "$1" "$image" "${@:2}"; }
# Writes a certificate of the front, a token and its right, readable by group 10001 only.
edge_files() {
  mkdir "$work/etc" && in_etc locus cert authority certs && in_etc locus cert server certs --name localhost || return
  cat "$work"/etc/certs/server.{pem,key} > "$work/etc/edge.pem" || return
  in_etc locus token create player --token-file tokens --expires 1d > "$work/etc/player.token" || return
  echo 'grant token:player admin arena-*' > "$work/etc/access.conf"
  in_etc chgrp -R 10001 . && in_etc chmod -R g+rX .
}
# Runs a command of `locus` as a client of the front.
edge_client() {
  podman run --rm --network host --user 0:10001 --volume "$work/etc:/etc/locus:ro" --entrypoint locus "$image" \
    -a "localhost:$edge_port" --ca /etc/locus/certs/ca.pem "$@"
}
edge_starts() {
  composed=deploy/edge/compose.yaml
  compose up --detach --no-build || return
  for _ in $(seq 100); do
    edge_client --token-file /etc/locus/player.token health && return
    sleep 0.2
  done
  compose logs
  return 1
}
# edge_refuses WORD ARGUMENTS...: passes if a client of the front is refused with a message that contains WORD.
edge_refuses() {
  local output code
  output=$(edge_client "${@:2}" 2>&1)
  code=$?
  printf '%s\n' "$output"
  [ "$code" != 0 ] && grep -qi -- "$1" <<< "$output"
}
# Plays the manifest of one daemon. With `again`, the volume claim is left out. Sets `id`.
kube_starts() {
  manifest=$work/locusd.yaml
  /usr/bin/python3 -B tests/deploy/kubernetes/podman_manifest.py deploy/kubernetes/single/locusd.yaml "$kube_port" "$kube_http_port" \
    ${1:+--without-claim} > "$manifest" || return
  podman kube play "$manifest" || return
  id=$(podman ps --quiet --filter name=locusd-pod-0-locusd) && [ -n "$id" ] || return
  for _ in $(seq 100); do
    kube_client health && return
    sleep 0.2
  done
  podman logs "$id"
  return 1
}
# Runs a command of `locus` as a client of the pod.
kube_client() { podman run --rm --network host --env LOCUS_ADDRESS=127.0.0.1:"$kube_port" --entrypoint locus "$image" "$@"; }
# Passes if the paths of the manifest's probes answer at the pod's HTTP port.
kube_probes_pass() {
  local paths path
  paths=$(sed -n 's/.*httpGet: {path: \([^,]*\), port: 7576}.*/\1/p' deploy/kubernetes/single/locusd.yaml)
  [ "$(wc -w <<< "$paths")" = 2 ] || return
  for path in $paths; do http_answers "http://127.0.0.1:$kube_http_port$path" || return; done
}
http_answers() { /usr/bin/python3 -c 'import sys, urllib.request as r; print(r.urlopen(sys.argv[1], timeout=10).status)' "$1"; }
kube_is_limited() {
  [ "$(podman inspect --format '{{.HostConfig.ReadonlyRootfs}} {{.HostConfig.Memory}} {{.HostConfig.NanoCpus}}' "$id")" = \
    "true 2147483648 2000000000" ]
}
kube_deletes() { podman kube down "$manifest" && [ -z "$(podman ps --all --quiet --filter name=locusd-pod-0)" ]; }
kube_keeps_its_scenes() { kube_client get kept --id 7 | grep -w 7; }
kube_stores_a_scene() { kube_client scene create kept && kube_client insert kept ball --id 7 --at 0,0,0 --radius 1; }
kube_ends() {
  [ -n "$manifest" ] || return 0
  podman kube down "$manifest"
  podman volume rm --force data-locusd-0 && manifest=
}
# Verifies a systemd unit after replacing its program by /bin/true, because systemd-analyze requires that the program is
# installed.
unit_is_correct() {
  local output unit
  unit=$work/$(basename "$1")
  sed -E 's#/usr/(local/bin/locusd|sbin/haproxy)#/bin/true#' "$1" > "$unit"
  # systemd-analyze exits with 0 even if it prints warnings.
  output=$(systemd-analyze verify --man=no "$unit" 2>&1) || return
  printf '%s' "$output"
  [ -z "$output" ]
}
# Passes if systemd rates the exposure of the unit at 1.1 or less; 0 is no exposure, 10 is complete exposure. The
# threshold is in tenths.
unit_is_hardened() { systemd-analyze security --offline=true --threshold=11 "$1"; }

check_image() {
  check "the image holds no tools" holds_no_tools
  check "the image holds all libraries" finds_its_libraries
  check "the image's label is the daemon's version" says_its_version
  check "without LOCUS_INSECURE=1 it refuses and explains both ways out" refuses_without_a_word
}

check_container() {
  need "a hardened container with limits answers" start --memory 256m --cpus 1
  check "its health check passes" is_healthy
  check "it runs as user 10001" runs_as_nobody_else
  check "its root is read-only, its folder is not" root_is_read_only
  check "it has no capability and can gain none" has_no_capability
  check "its threads follow the processor time it is given" started_with threads=1
  check "its memory follows the limit it is given" started_with memory_bytes=201326592
  check "locus limits lists its memory" lists_its_memory
  check "it answers the example script from inside" answers_inside client/cli/script/examples/first_steps.lua
  check "it answers the example script through its port" answers_outside client/cli/script/examples/first_steps.lua
  check "it refuses a mesh that would not fit and lives on" refuses_what_does_not_fit
  check "it ends in order when it is stopped" ends_in_order
  if [ "$(nproc)" -gt 1 ]; then
    need "a container on one processor answers" start --cpuset-cpus 0
    check "its threads follow the processors it may use" started_with threads=1
  else
    skip "threads follow the processors" "this machine has one"
  fi
}

if [ "$(id -u)" != 0 ]; then
  skip "image and container" "building and running them needs root"
  finish
fi
need "packages" ./deploy/packages.sh container
for unit in deploy/locusd.service deploy/edge/locus-edge.service; do
  check "$(basename "$unit") is correct" unit_is_correct "$unit"
  check "the exposure of $(basename "$unit") is at most 1.1 of 10" unit_is_hardened "$unit"
done
need "podman is set up" set_up_podman
need "base image" make_base
need "image" build_image
check_image
check_container
compose_port=$(free_port)
compose_http_port=$(free_port)
edge_port=$(free_port)
check "compose starts it on this machine's loopback" compose_starts
check "its HTTP port says that it is ready" http_ready
check "compose ends it" compose_ends
kube_port=$(free_port)
kube_http_port=$(free_port)
need "podman plays the manifest for Kubernetes" kube_starts
check "the pod's probes pass" kube_probes_pass
check "the pod has the limits of compose.yaml" kube_is_limited
check "the pod has no capability and can gain none" has_no_capability
check "the pod runs as user 10001" runs_as_nobody_else
need "the pod stores a scene" kube_stores_a_scene
check "the pod is deleted" kube_deletes
need "podman plays the manifest again" kube_starts again
check "the scene has survived deletion and new start" kube_keeps_its_scenes
check "the pod and its volume are deleted" kube_ends
need "image of the front" build_edge_image
need "certificate, token and right for the front" edge_files
need "compose starts a daemon behind the front" edge_starts
check "the front passes on a token" edge_client --token-file /etc/locus/player.token scene create arena-1
check "the token's right is enforced behind the front" \
  edge_refuses "token:player lacks the right admin" --token-file /etc/locus/player.token scene create other
check "a client without a token is refused behind the front" edge_refuses "user:10002 lacks the right read" scene list
finish
