// The server's version, printed by `locusd --version` and returned by GetServer. The build sets it from the project.
#ifndef LOCUS_SERVER_CONFIG_VERSION_H_
#define LOCUS_SERVER_CONFIG_VERSION_H_

namespace locus::server {

// major.minor.patch
inline constexpr const char* kVersion = LOCUS_VERSION;

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_VERSION_H_
