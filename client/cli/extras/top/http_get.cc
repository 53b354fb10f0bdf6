#include "client/cli/extras/top/http_get.h"

#include <curl/curl.h>

#include <memory>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/lib/authorization.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

size_t take(char* data, size_t size, size_t count, void* body) {
  auto& text = *static_cast<std::string*>(body);
  // If this callback returns fewer bytes than it was given, libcurl aborts the transfer.
  if (text.size() + size * count > kMaxPageBytes) return 0;
  text.append(data, size * count);
  return size * count;
}

absl::Status failure(CURLcode code, const std::string& address) {
  switch (code) {
    case CURLE_WRITE_ERROR:
      return absl::ResourceExhaustedError(
          absl::StrCat(address, " answers with more than ", kMaxPageBytes, " bytes; is it locusd's HTTP port?"));
    case CURLE_URL_MALFORMAT:
      return absl::InvalidArgumentError(absl::StrCat("`", address, "` is no address; write host:port"));
    case CURLE_GOT_NOTHING:
      return absl::UnavailableError(
          absl::StrCat(address, " closed the connection; if it uses TLS, give --ca or --tls"));
    case CURLE_PEER_FAILED_VERIFICATION:
      return absl::UnavailableError(absl::StrCat("the certificate of ", address,
                                                 " is not accepted: ", curl_easy_strerror(code),
                                                 "; --ca names its authority, --server-name the name in it"));
    default:
      return absl::UnavailableError(absl::StrCat("no metrics from ", address, ": ", curl_easy_strerror(code),
                                                 "; locusd serves them where its --http-listen says"));
  }
}

// Returns the error for a page that the server answered with the HTTP status `answer`, which is not 200. `body` is the
// text of the server's answer.
absl::Status refused_page(long answer, const std::string& page, const std::string& body) {
  const std::string text =
      absl::StrCat(page, " answers ", answer, ": ", absl::StripAsciiWhitespace(body.substr(0, 500)));
  if (answer == 401) return absl::UnauthenticatedError(text);
  if (answer == 403) return absl::PermissionDeniedError(text);
  return absl::FailedPreconditionError(absl::StrCat(page, " answers ", answer, "; is it the HTTP port of locusd?"));
}

void set_credentials(CURL* curl, const client::CredentialOptions& credentials) {
  const auto set_file = [curl](CURLoption option, const std::string& file) {
    if (!file.empty()) curl_easy_setopt(curl, option, file.c_str());
  };
  set_file(CURLOPT_CAINFO, credentials.ca_file);
  set_file(CURLOPT_SSLCERT, credentials.certificate_file);
  set_file(CURLOPT_SSLKEY, credentials.key_file);
  curl_easy_setopt(curl, CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
}

struct FreeList {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

}  // namespace

absl::StatusOr<std::string> http_get(const std::string& address, const std::string& path,
                                     const client::CredentialOptions& credentials, std::chrono::milliseconds timeout) {
  static const CURLcode kReady = curl_global_init(CURL_GLOBAL_DEFAULT);
  const std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> curl(curl_easy_init(), curl_easy_cleanup);
  if (kReady != CURLE_OK || curl == nullptr) return absl::InternalError("libcurl does not start");
  ASSIGN_OR_RETURN(const std::shared_ptr<client::Authorization> authorization,
                   client::Authorization::make(credentials, address));
  const std::string header = authorization->header();
  const std::unique_ptr<curl_slist, FreeList> headers(
      header.empty() ? nullptr : curl_slist_append(nullptr, absl::StrCat("Authorization: ", header).c_str()));
  const char* const scheme = client::uses_tls(credentials) ? "https" : "http";
  // The certificate must belong to the host of the URL. With a server name, curl takes this name as the host, but
  // connects to `address`.
  const std::string& name = credentials.server_name;
  const std::unique_ptr<curl_slist, FreeList> destination(
      name.empty() ? nullptr : curl_slist_append(nullptr, absl::StrCat("::", address).c_str()));
  std::string body;
  curl_easy_setopt(curl.get(), CURLOPT_URL, absl::StrCat(scheme, "://", name.empty() ? address : name, path).c_str());
  curl_easy_setopt(curl.get(), CURLOPT_CONNECT_TO, destination.get());
  curl_easy_setopt(curl.get(), CURLOPT_PROTOCOLS_STR, scheme);
  curl_easy_setopt(curl.get(), CURLOPT_HTTPHEADER, headers.get());
  set_credentials(curl.get(), credentials);
  curl_easy_setopt(curl.get(), CURLOPT_PROXY, "");
  curl_easy_setopt(curl.get(), CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl.get(), CURLOPT_TIMEOUT_MS, static_cast<long>(timeout.count()));
  curl_easy_setopt(curl.get(), CURLOPT_WRITEFUNCTION, take);
  curl_easy_setopt(curl.get(), CURLOPT_WRITEDATA, &body);
  if (const CURLcode code = curl_easy_perform(curl.get()); code != CURLE_OK) return failure(code, address);
  long answer = 0;
  curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &answer);
  if (answer != 200) return refused_page(answer, address + path, body);
  return body;
}

}  // namespace locus::cli
