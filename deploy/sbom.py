"""Writes what a Debian package ships and links, as an SPDX 2.3 document in JSON:

    python3 sbom.py PACKAGE.deb > PACKAGE.spdx.json

Lists the files of the package with checksums, the packages of the shared libraries that its programs load, directly or
through other libraries, and the header libraries that are compiled into its programs. Licences come from the copyright
files that Debian's packages install. The libraries must be installed on this machine: where the package was built, they
are. Two runs about the same package write the same bytes.
"""

import collections
import datetime
import gzip
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
import urllib.parse
import uuid

# Libraries whose code is compiled into locusd, locus and the static libraries, with the headers that name them.
HEADER_LIBRARIES = ("libboost1.74-dev", "libcli11-dev", "nlohmann-json3-dev")
# Licences as Debian's copyright files name them, and their names in SPDX's list. Others keep their whole text.
SPDX_LICENSES = {
    "apache-2.0": "Apache-2.0", "bsd-2-clause": "BSD-2-Clause", "bsd-3-clause": "BSD-3-Clause", "expat": "MIT", "mit": "MIT",
    "bsl-1.0": "BSL-1.0", "zlib": "Zlib", "isc": "ISC", "gpl-1+": "GPL-1.0-or-later", "gpl-2": "GPL-2.0-only",
    "gpl-2+": "GPL-2.0-or-later", "gpl-2.0": "GPL-2.0-only", "gpl-2.0+": "GPL-2.0-or-later", "gpl-3": "GPL-3.0-only",
    "gpl-3+": "GPL-3.0-or-later", "gpl-3.0+": "GPL-3.0-or-later", "lgpl-2": "LGPL-2.0-only", "lgpl-2+": "LGPL-2.0-or-later",
    "lgpl-2.0+": "LGPL-2.0-or-later", "lgpl-2.1": "LGPL-2.1-only", "lgpl-2.1+": "LGPL-2.1-or-later", "lgpl-3": "LGPL-3.0-only",
    "lgpl-3+": "LGPL-3.0-or-later", "lgpl-3.0+": "LGPL-3.0-or-later", "cc0-1.0": "CC0-1.0", "artistic": "Artistic-1.0-Perl",
    "artistic-2.0": "Artistic-2.0", "mpl-1.1": "MPL-1.1", "mpl-2.0": "MPL-2.0", "psf-2": "PSF-2.0", "openssl": "OpenSSL",
    "unlicense": "Unlicense", "curl": "curl", "ofl-1.1": "OFL-1.1",
}


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def spdx_id(*words):
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", "-".join(words))


class Licenses:
    """Turns licences of copyright files into SPDX expressions. Keeps the texts that SPDX's list does not have."""

    def __init__(self):
        self.extracted = {}

    def whole_text(self, package, text):
        name = package + "-copyright"
        identifier = "LicenseRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name)
        self.extracted[identifier] = {"licenseId": identifier, "name": name, "extractedText": text}
        return identifier

    def of_copyright(self, package, text):
        """Returns the expression for one copyright file: all its licences joined by AND. If SPDX's list lacks one of them,
        the whole file is part of the expression.
        """
        names = re.findall(r"^License:[ \t]*(\S.*)$", text, re.MULTILINE) if text.startswith("Format:") else []
        parts = {part.strip(" ()") for name in names for part in re.split(r"\s+(?:and|or)\s+|,|\|", name, flags=re.IGNORECASE)}
        parts.discard("")
        known = {SPDX_LICENSES[part.lower()] for part in parts if part.lower() in SPDX_LICENSES}
        unknown = [part for part in parts if part.lower() not in SPDX_LICENSES]
        return " AND ".join(sorted(known) + ([self.whole_text(package, text)] if unknown or not known else []))

    def of_installed(self, package):
        path = f"/usr/share/doc/{package}/copyright"
        if not os.path.exists(path):
            return "NOASSERTION"
        with open(path, encoding="utf-8", errors="replace") as file:
            return self.of_copyright(package, file.read())


def needed(path):
    return re.findall(r"\(NEEDED\)\s+Shared library: \[(.+)\]", run("readelf", "--dynamic", "--wide", path))


def is_program(path):
    with open(path, "rb") as file:
        return file.read(4) == b"\x7fELF"


def library_paths():
    """Returns the paths of this machine's libraries by name; the first that the loader would take."""
    paths = {}
    for name, path in re.findall(r"^\s+(\S+) \(.*\) => (/\S+)$", run("/sbin/ldconfig", "-p"), re.MULTILINE):
        paths.setdefault(name, path)
    return paths


def packages_of(libraries):
    """Returns the package that installed each library, by name. `libraries` maps names to paths. Debian's lists have some
    paths from before /lib became /usr/lib, so each path is looked up as the loader, the file system and these lists have it.
    """
    candidates = {}
    for name, path in libraries.items():
        real = os.path.realpath(path)
        candidates[name] = [path, real, "/usr" + path, real.removeprefix("/usr")]
    found = subprocess.run(["dpkg-query", "--search", *sorted({path for paths in candidates.values() for path in paths})],
                           capture_output=True, text=True, check=False).stdout
    owners = {path: owner for owner, path in re.findall(r"^([^:, ]+)(?::\w+)?: (/.*)$", found, re.MULTILINE)}
    packages = {name: next((owners[path] for path in paths if path in owners), None) for name, paths in candidates.items()}
    missing = [name for name, package in packages.items() if package is None]
    if missing:
        raise SystemExit(f"sbom.py: no package has installed {' '.join(missing)}")
    return packages


def linked_packages(programs):
    """Returns the packages of the libraries that the programs load: those that they name themselves, and all others."""
    paths = library_paths()
    direct = {name for program in programs for name in needed(program)}
    waiting, seen = collections.deque(sorted(direct)), set(direct)
    while waiting:
        name = waiting.popleft()
        if name not in paths:
            raise SystemExit(f"sbom.py: {name} is not installed here")
        others = [other for other in needed(paths[name]) if other not in seen]
        seen.update(others)
        waiting.extend(others)
    owners = packages_of({name: paths[name] for name in seen})
    named = {owners[name] for name in direct}
    return named, set(owners.values()) - named


def installed_package(package, licenses):
    version, architecture, source = run("dpkg-query", "--show", "--showformat=${Version}\t${Architecture}\t${source:Package}\n",
                                        package).splitlines()[0].split("\t")
    license_expression = licenses.of_installed(package)
    return package_element(package, version, architecture, license_expression, comment=f"Source package: {source}")


def package_element(name, version, architecture, license_expression, **more):
    url = f"pkg:deb/debian/{name}@{urllib.parse.quote(version, safe='')}?arch={architecture}"
    return {"name": name, "SPDXID": spdx_id("Package", name), "versionInfo": version, "downloadLocation": "NOASSERTION",
            "filesAnalyzed": False, "licenseConcluded": "NOASSERTION", "licenseDeclared": license_expression,
            "copyrightText": "NOASSERTION",
            "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": url}], **more}


def digest(path, algorithm):
    with open(path, "rb") as file:
        return hashlib.new(algorithm, file.read()).hexdigest()


def file_elements(root):
    elements = []
    for place, _, names in sorted(os.walk(root)):
        for name in sorted(names):
            path = os.path.join(place, name)
            if os.path.islink(path):
                continue
            shown = "./" + os.path.relpath(path, root)
            checksums = [{"algorithm": kind.upper(), "checksumValue": digest(path, kind)} for kind in ("sha1", "sha256")]
            elements.append({"fileName": shown, "SPDXID": spdx_id("File", hashlib.sha1(shown.encode()).hexdigest()),
                             "checksums": checksums, "licenseConcluded": "NOASSERTION", "copyrightText": "NOASSERTION"})
    return elements


def verification_code(files):
    sums = sorted(element["checksums"][0]["checksumValue"] for element in files)
    return hashlib.sha1("".join(sums).encode()).hexdigest()


def relation(one, kind, other):
    return {"spdxElementId": one, "relationshipType": kind, "relatedSpdxElement": other}


def document(deb, root):
    fields = run("dpkg-deb", "--showformat=${Package}\t${Version}\t${Architecture}\t${Maintainer}", "--show", deb)
    name, version, architecture, maintainer = fields.split("\t")
    licenses = Licenses()
    files = file_elements(root)
    paths = [os.path.join(root, element["fileName"]) for element in files]
    programs = [path for path in paths if is_program(path)]
    direct, indirect = linked_packages(programs)
    headers = HEADER_LIBRARIES if programs or any(path.endswith(".a") for path in paths) else ()
    with open(os.path.join(root, "usr/share/doc", name, "copyright"), encoding="utf-8") as file:
        own_license = licenses.of_copyright(name, file.read())
    (changelog,) = [path for path in paths if re.search(r"/changelog(\.Debian)?\.gz$", path)]
    with gzip.open(changelog, "rt", encoding="utf-8") as file:
        when = re.search(r"^ -- .*>  (.*)$", file.read(), re.MULTILINE).group(1)
    created = datetime.datetime.strptime(when, "%a, %d %b %Y %H:%M:%S %z").astimezone(datetime.timezone.utc)
    checksum = digest(deb, "sha256")
    shipped = package_element(name, version, architecture, own_license, supplier="Organization: " + maintainer.split(" <")[0],
                              packageFileName=os.path.basename(deb))
    shipped.update(filesAnalyzed=True, packageVerificationCode={"packageVerificationCodeValue": verification_code(files)},
                   checksums=[{"algorithm": "SHA256", "checksumValue": checksum}], licenseInfoFromFiles=["NOASSERTION"])
    packages = [shipped] + [installed_package(other, licenses) for other in sorted(direct | indirect | set(headers))]
    own = shipped["SPDXID"]
    relations = [relation("SPDXRef-DOCUMENT", "DESCRIBES", own)]
    relations += [relation(own, "CONTAINS", element["SPDXID"]) for element in files]
    relations += [relation(own, "DYNAMIC_LINK", spdx_id("Package", other)) for other in sorted(direct)]
    relations += [relation(own, "DEPENDS_ON", spdx_id("Package", other)) for other in sorted(indirect)]
    relations += [relation(own, "STATIC_LINK", spdx_id("Package", other)) for other in headers]
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
            "name": f"{name}_{version}_{architecture}",
            "documentNamespace": "urn:uuid:" + str(uuid.uuid5(uuid.NAMESPACE_OID, checksum)),
            "creationInfo": {"created": created.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: locus-sbom-" + version]},
            "packages": packages, "files": files, "relationships": relations,
            "hasExtractedLicensingInfos": [licenses.extracted[key] for key in sorted(licenses.extracted)]}


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as root:
        run("dpkg-deb", "--extract", sys.argv[1], root)
        json.dump(document(sys.argv[1], root), sys.stdout, indent=1)
        print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
