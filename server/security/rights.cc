#include "server/security/rights.h"

namespace locus::server {

const RpcRight* right_of(absl::string_view path) {
  for (const RpcRight& row : kRpcRights)
    if (row.path == path) return &row;
  return nullptr;
}

std::optional<Right> right_named(absl::string_view name) {
  for (size_t i = 0; i < kRights; ++i)
    if (kRightNames[i] == name) return static_cast<Right>(i);
  return std::nullopt;
}

}  // namespace locus::server
