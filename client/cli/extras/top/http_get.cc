#include "client/cli/extras/top/http_get.h"

#include <curl/curl.h>

#include <memory>

#include "absl/strings/str_cat.h"

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
    default:
      return absl::UnavailableError(absl::StrCat("no metrics from ", address, ": ", curl_easy_strerror(code),
                                                 "; locusd serves them where its --http-listen says"));
  }
}

}  // namespace

absl::StatusOr<std::string> http_get(const std::string& address, const std::string& path,
                                     std::chrono::milliseconds timeout) {
  static const CURLcode kReady = curl_global_init(CURL_GLOBAL_DEFAULT);
  const std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> curl(curl_easy_init(), curl_easy_cleanup);
  if (kReady != CURLE_OK || curl == nullptr) return absl::InternalError("libcurl does not start");
  std::string body;
  curl_easy_setopt(curl.get(), CURLOPT_URL, absl::StrCat("http://", address, path).c_str());
  curl_easy_setopt(curl.get(), CURLOPT_PROTOCOLS_STR, "http");
  curl_easy_setopt(curl.get(), CURLOPT_PROXY, "");
  curl_easy_setopt(curl.get(), CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl.get(), CURLOPT_TIMEOUT_MS, static_cast<long>(timeout.count()));
  curl_easy_setopt(curl.get(), CURLOPT_WRITEFUNCTION, take);
  curl_easy_setopt(curl.get(), CURLOPT_WRITEDATA, &body);
  if (const CURLcode code = curl_easy_perform(curl.get()); code != CURLE_OK) return failure(code, address);
  long answer = 0;
  curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &answer);
  if (answer != 200)
    return absl::FailedPreconditionError(
        absl::StrCat(address, path, " answers ", answer, "; is it the HTTP port of locusd?"));
  return body;
}

}  // namespace locus::cli
