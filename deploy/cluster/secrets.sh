#!/bin/sh
# Makes the passwords of the engine, once, in a folder that others cannot read:
#   engine.env   variables of Patroni's nodes
#   passfile     password file of locusd, as libpq reads it: for its owner only
# As root, it gives the passfile to user 10001, the user of locusd's image.
set -eu
if [ $# -ne 1 ]; then
  echo "usage: deploy/cluster/secrets.sh FOLDER" >&2
  exit 2
fi
umask 077
mkdir -p "$1"
if [ -e "$1/engine.env" ] || [ -e "$1/passfile" ]; then
  echo "secrets.sh: $1 has passwords already; they stay as they are" >&2
  exit 1
fi
password() { od -An -N 24 -t x1 /dev/urandom | tr -d ' \n'; }
locus=$(password)
cat > "$1/engine.env" <<TEXT
PATRONI_SUPERUSER_USERNAME=postgres
PATRONI_SUPERUSER_PASSWORD=$(password)
PATRONI_REPLICATION_USERNAME=replicator
PATRONI_REPLICATION_PASSWORD=$(password)
PATRONI_RESTAPI_USERNAME=patroni
PATRONI_RESTAPI_PASSWORD=$(password)
LOCUS_ENGINE_PASSWORD=$locus
TEXT
echo "*:*:locus:locus:$locus" > "$1/passfile"
if [ "$(id -u)" -eq 0 ]; then
  chown 10001:10001 "$1/passfile"
  chmod 0711 "$1"
fi
