"""Connections that are configured like the command line: by the environment and by the contexts of `locus context`."""
from __future__ import annotations

import os
import re
from typing import Any, Dict, Optional, Tuple

from .client import Client, connect

_OPTIONS = ("ca", "cert", "key", "server_name", "token_file")
_BOOLEANS = {"true": True, "t": True, "yes": True, "y": True, "1": True,
             "false": False, "f": False, "no": False, "n": False, "0": False}
_MAX_BYTES = 1 << 20
_NAME = re.compile(r"[A-Za-z0-9_.-]{1,63}")

_Context = Dict[str, str]


def connect_from_environment(context: str = "", **options: Any) -> Client:
    """Connects to the server that the environment and the user's contexts describe.

    Reads LOCUS_ADDRESS, LOCUS_TLS, LOCUS_CA, LOCUS_CERT, LOCUS_KEY, LOCUS_SERVER_NAME, LOCUS_TOKEN_FILE and
    LOCUS_TOKEN. Options that are not set by these variables come from a named context. Its name is `context`, or the
    value of LOCUS_CONTEXT if `context` is empty. If both are empty and LOCUS_ADDRESS is not set, the user's default
    context is used. If LOCUS_ADDRESS is set, the default context is not used, so that its credentials do not reach
    another server. `options`: further options of connect(); they take precedence over the environment. Raises
    ValueError for an unknown context, a malformed file of contexts or a wrong LOCUS_TLS, OSError for a file of contexts
    that cannot be read, and the errors of connect().
    """
    return connect(**{**endpoint(context), **options})


def endpoint(context: str = "") -> Dict[str, Any]:
    """Returns the options of connect() that the environment and the contexts specify."""
    found: Dict[str, Any] = {name: os.environ[_variable(name)] for name in ("address", "token") + _OPTIONS
                             if os.environ.get(_variable(name))}
    tls = os.environ.get("LOCUS_TLS", "")
    if tls:
        if tls.lower() not in _BOOLEANS:
            raise ValueError(f"LOCUS_TLS is true or false, not {tls!r}")
        found["tls"] = _BOOLEANS[tls.lower()]
    if "token_file" in found:
        found.pop("token", None)
    name = context or os.environ.get("LOCUS_CONTEXT", "")
    if name or "address" not in found:
        _complete(found, name)
    return found


def _variable(option: str) -> str:
    return f"LOCUS_{option.upper()}"


def _complete(found: Dict[str, Any], name: str) -> None:
    """Adds to `found` the options that it lacks, from the context `name` or, if `name` is empty, from the default
    context.
    """
    default, contexts = _read_contexts(_contexts_path())
    name = name or default
    if not name:
        return
    if name not in contexts:
        raise ValueError(f"there is no context {name}; there is {', '.join(sorted(contexts)) or 'none'}: "
                         "`locus context set NAME` makes one")
    saved = contexts[name]
    has_own_certificate = "cert" in found or "key" in found
    for option in ("address",) + _OPTIONS:
        if option in ("cert", "key") and has_own_certificate or option == "token_file" and "token" in found:
            continue
        if saved.get(option):
            found.setdefault(option, saved[option])
    found.setdefault("tls", saved.get("tls") == "true")


def _contexts_path() -> Optional[str]:
    config, user = os.environ.get("XDG_CONFIG_HOME", ""), os.environ.get("HOME", "")
    if config.startswith("/"):
        return f"{config}/locus/contexts"
    return f"{user}/.config/locus/contexts" if user.startswith("/") else None


def _read_contexts(path: Optional[str]) -> Tuple[str, Dict[str, _Context]]:
    """Returns the name of the default context and all contexts; none if there is no file."""
    if path is None or not os.path.exists(path):
        return "", {}
    with open(path, encoding="utf-8") as file:
        text = file.read(_MAX_BYTES + 1)
    if len(text) > _MAX_BYTES:
        raise ValueError(f"{path} is larger than {_MAX_BYTES} bytes")
    default = ""
    contexts: Dict[str, _Context] = {}
    section: Optional[_Context] = None
    for number, line in enumerate(text.split("\n"), 1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        key, _, value = (part.strip() for part in line.partition("="))
        if line[0] == "[" and line[-1] == "]" and _NAME.fullmatch(line[1:-1]):
            section = contexts.setdefault(line[1:-1], {})
        elif section is None and key == "default":
            default = value
        elif section is not None and (key in ("address", "scene") + _OPTIONS or key == "tls" and value in ("true", "false")):
            section[key] = value
        else:
            raise ValueError(f"{path}:{number}: neither `[NAME]` nor `KEY = VALUE` with address, tls, ca, cert, key, "
                             "server_name, token_file or scene")
    return default, contexts
