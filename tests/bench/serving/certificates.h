// Certificates of an authority, of a server on the loopback and of a client, and the options with which a daemon and
// its clients use them. Used by the cases with TLS. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_CERTIFICATES_H_
#define LOCUS_TESTS_BENCH_SERVING_CERTIFICATES_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/lib/options.h"
#include "tests/bench/frame/temporary_folder.h"

namespace locus::bench::serving {

// Protection of connections. kMutualTls = the client must have a certificate too.
enum class Transport : uint8_t { kPlain, kTls, kMutualTls };

class Certificates {
 public:
  // Makes the certificates by the program `locus` in the folder of this program. Returns UNAVAILABLE if `locus` is
  // missing or fails; in the second case the message contains the output of `locus`.
  static absl::StatusOr<std::unique_ptr<Certificates>> make();
  Certificates(const Certificates&) = delete;
  Certificates& operator=(const Certificates&) = delete;

  // Return the options of locusd and of its clients. The options name files of this object, so this object must outlive
  // their use.
  std::vector<std::string> daemon_options(Transport transport) const;
  client::CredentialOptions client_options(Transport transport) const;

 private:
  Certificates() = default;
  absl::Status run_cert(std::vector<std::string> words) const;

  const TemporaryFolder folder_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_CERTIFICATES_H_
