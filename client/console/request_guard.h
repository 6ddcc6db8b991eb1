// The guard of the console, which answers requests of its own page alone, in the browser of its user.
#ifndef WELLSPACE_CLIENT_CONSOLE_REQUEST_GUARD_H_
#define WELLSPACE_CLIENT_CONSOLE_REQUEST_GUARD_H_

#include <optional>
#include <string>
#include <string_view>

namespace wellspace::console {

// A secret of 128 bits from the kernel, 32 hexadecimal digits.
std::string MakeToken();

// The headers of a request that are looked at first. Absent: the request has no such header.
struct RequestHead {
  std::string_view method;
  std::string_view path;  // decoded, with its first slash
  std::optional<std::string_view> host{};
  std::optional<std::string_view> origin{};
  std::optional<std::string_view> fetch_site{};  // Sec-Fetch-Site
};

struct Refusal {
  int status;  // of HTTP
  std::string_view message;
};

// The secret is in the path, not in a cookie: cookies of 127.0.0.1 are sent to every port, which other users of the
// machine may listen on.
//
// Thread safety: thread-compatible; constant after construction.
class RequestGuard {
 public:
  RequestGuard(int port, std::string token);

  // "/TOKEN/".
  const std::string& prefix() const { return prefix_; }

  // Nothing for a request that is to be answered.
  //
  // Guarantees: (1) the host is a name of the loopback with the port, so that no name of another site that leads here
  //             is answered (DNS rebinding); (2) the path begins with the prefix, which is compared in the same time
  //             whatever it is; (3) a request that says where it comes from, by Origin or Sec-Fetch-Site, comes from
  //             the console's own page, or was typed by the user; (4) the method is GET, HEAD, POST or DELETE.
  std::optional<Refusal> Refuse(const RequestHead& head) const;

 private:
  bool IsOwnHost(std::string_view host) const;

  const std::string port_;
  const std::string prefix_;
};

}  // namespace wellspace::console

#endif  // WELLSPACE_CLIENT_CONSOLE_REQUEST_GUARD_H_
