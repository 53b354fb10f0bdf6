#!/bin/sh
# Makes the user and the database of locusd; Patroni runs it once, on the first node, with the address of that node.
# LOCUS_ENGINE_PASSWORD is the password of the user. It does not appear among the arguments of a process.
set -eu
psql --no-psqlrc --quiet --set ON_ERROR_STOP=1 "$1" <<'SQL'
\getenv password LOCUS_ENGINE_PASSWORD
CREATE ROLE locus LOGIN PASSWORD :'password';
CREATE DATABASE locus OWNER locus ENCODING 'UTF8' TEMPLATE template0;
REVOKE ALL ON DATABASE locus FROM PUBLIC;
SQL
