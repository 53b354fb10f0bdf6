// Finds out whether the kernel can distinguish the users of unix sockets in this user namespace. A pure function; any
// thread.
#ifndef LOCUS_SERVER_SECURITY_HIDDEN_USERS_H_
#define LOCUS_SERVER_SECURITY_HIDDEN_USERS_H_

#include "absl/strings/string_view.h"

namespace locus::server {

// Returns whether a user namespace shows some users of the machine as the user `nobody`. `uid_map` is the text of
// /proc/self/uid_map. Each line maps a range of users: the first user id inside the namespace, the first user id
// outside, and the number of users. Returns false for an empty or malformed text.
bool hides_users(absl::string_view uid_map);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_HIDDEN_USERS_H_
