#include "client/console/request_guard.h"

#include <sys/random.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace wellspace::console {
namespace {

bool IsEqualInTheSameTime(std::string_view one, std::string_view other) {
  unsigned differences = one.size() == other.size() ? 0 : 1;
  for (size_t i = 0; i < other.size(); ++i) {
    differences |= static_cast<unsigned char>(i < one.size() ? one[i] ^ other[i] : 1);
  }
  return differences == 0;
}

}  // namespace

std::string MakeToken() {
  std::array<char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    std::abort();  // the kernel gives up to 256 bytes at once
  }
  return absl::BytesToHexString({bytes.data(), bytes.size()});
}

RequestGuard::RequestGuard(int port, std::string token)
    : port_(absl::StrCat(":", port)), prefix_(absl::StrCat("/", token, "/")) {}

bool RequestGuard::IsOwnHost(std::string_view host) const {
  if (!host.ends_with(port_)) {
    return false;
  }
  host.remove_suffix(port_.size());
  return host == "127.0.0.1" || host == "localhost" || host == "[::1]";
}

std::optional<Refusal> RequestGuard::Refuse(const RequestHead& head) const {
  if (!head.host.has_value() || !IsOwnHost(*head.host)) {
    return Refusal{421, "The console answers to 127.0.0.1 and localhost alone."};
  }
  if (!IsEqualInTheSameTime(head.path.substr(0, prefix_.size()), prefix_)) {
    return Refusal{404, "Not found. The address of the console is that which the tool has printed."};
  }
  if (head.method != "GET" && head.method != "HEAD" && head.method != "POST" && head.method != "DELETE") {
    return Refusal{405, "The console knows GET, HEAD, POST and DELETE."};
  }
  constexpr std::string_view kScheme = "http://";
  if (head.origin.has_value() &&
      (!head.origin->starts_with(kScheme) || head.origin->substr(kScheme.size()) != *head.host)) {
    return Refusal{403, "The console answers to its own page alone."};
  }
  if (head.fetch_site.has_value() && *head.fetch_site != "same-origin" && *head.fetch_site != "none") {
    // The first page may be opened by a file, which redirects to it.
    const bool is_first_page = head.method == "GET" && head.path == prefix_;
    if (!is_first_page) {
      return Refusal{403, "The console answers to its own page alone."};
    }
  }
  return std::nullopt;
}

}  // namespace wellspace::console
