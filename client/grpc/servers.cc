#include "client/grpc/servers.h"

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/address.h"
#include "client/error_details.h"
#include "client/printable.h"
#include "grpcpp/channel.h"

namespace wellspace::client {
namespace {

constexpr char kElsewhere[] = "ERROR_REASON_SESSION_ELSEWHERE";

// Beyond these all is forgotten, which costs each session one more answer that says where it is.
constexpr size_t kMostOthers = 64;
constexpr size_t kMostOwned = size_t{1} << 14;

// Of an address that comes with an error message: a host's name has 253 characters at most.
constexpr size_t kLongestShown = 300;

// Whether `status` leaves open if its server still has the session.
bool LeavesOwnerOpen(const absl::Status& status) {
  const std::string reason = ReasonOf(status);
  return absl::IsUnavailable(status) || (absl::IsDeadlineExceeded(status) && reason.empty()) ||
         reason == "ERROR_REASON_SESSION_NOT_FOUND";
}

// `status`, with the address that it is about unless the server has said what is wrong itself.
absl::Status WithServer(const absl::Status& status, const Server& asked) {
  if (asked.address.empty() || !ReasonOf(status).empty() ||
      (!absl::IsUnavailable(status) && !absl::IsUnauthenticated(status))) {
    return status;
  }
  return WithMessage(status, absl::StrCat(status.message(), "; so it was at ", asked.address,
                                          ", where the session is, as another server has said"));
}

}  // namespace

std::string SessionIdOf(std::string_view name) {
  constexpr std::string_view kPrefix = "sessions/";
  constexpr size_t kLongest = 128;
  if (!name.starts_with(kPrefix)) {
    return "";
  }
  const std::string_view id = name.substr(kPrefix.size(), name.find('/', kPrefix.size()) - kPrefix.size());
  // gRPC aborts on metadata that HTTP/2 cannot carry, and a name is whatever a user has typed.
  const bool is_plain = std::ranges::all_of(
      id, [](unsigned char c) { return absl::ascii_isalnum(c) || c == '-' || c == '_' || c == '.'; });
  return is_plain && id.size() <= kLongest ? std::string(id) : "";
}

Server::Server(std::string named, const std::shared_ptr<grpc::Channel>& channel)
    : address(std::move(named)),
      meshing(v1::MeshingService::NewStub(channel)),
      sessions(v1::SessionService::NewStub(channel)),
      operations(v1::OperationService::NewStub(channel)),
      queries(v1::QueryService::NewStub(channel)),
      admin(v1::AdminService::NewStub(channel)),
      health(grpc::health::v1::Health::NewStub(channel)) {}

Servers::Servers(const std::shared_ptr<grpc::Channel>& channel, OpenChannelTo open)
    : open_(std::move(open)), first_(std::make_shared<const Server>("", channel)) {}

std::shared_ptr<const Server> Servers::Of(const std::string& id) const {
  std::lock_guard lock(mutex_);
  const auto found = owners_of_ids_.find(id);
  return found == owners_of_ids_.end() ? first_ : found->second;
}

absl::Status Servers::Follow(const std::string& id, const Server& asked, const absl::Status& status, Attempt& attempt) {
  if (status.ok() || open_ == nullptr || id.empty()) {
    return status;
  }
  if (LeavesOwnerOpen(status)) {
    Forget(id, asked);
  }
  if (ReasonOf(status) != kElsewhere) {
    return WithServer(status, asked);
  }
  const std::string address = OwnerAddressOf(status);
  if (address.empty()) {
    return status;
  }
  if (const absl::Status refused = GoTo(id, address); !refused.ok()) {
    return attempt.Final(refused);
  }
  attempt.SetRedirected();
  return status;
}

absl::Status Servers::GoTo(const std::string& id, const std::string& address) {
  if (!HostOfNamed(address).ok()) {
    return absl::DataLossError(absl::StrCat("the server says that the session is at '",
                                            Printable(address.substr(0, kLongestShown)),
                                            "'; expected the HOST:PORT of a server, as its --advertise has it"));
  }
  {
    std::lock_guard lock(mutex_);
    if (const auto known = others_.find(address); known != others_.end()) {
      if (owners_of_ids_.size() >= kMostOwned) {
        owners_of_ids_.clear();
      }
      owners_of_ids_[id] = known->second;
      return absl::OkStatus();
    }
  }
  // Reads files, perhaps.
  const absl::StatusOr<std::shared_ptr<grpc::Channel>> channel = open_(address);
  if (!channel.ok()) {
    return WithMessage(channel.status(),
                       absl::StrCat("the session is at another server, ", address, ": ", channel.status().message()));
  }
  auto server = std::make_shared<const Server>(address, *channel);
  std::lock_guard lock(mutex_);
  if (others_.size() >= kMostOthers || owners_of_ids_.size() >= kMostOwned) {
    others_.clear();
    owners_of_ids_.clear();
  }
  // Another call may have been faster.
  owners_of_ids_[id] = others_.emplace(address, std::move(server)).first->second;
  return absl::OkStatus();
}

void Servers::Forget(const std::string& id, const Server& asked) {
  std::lock_guard lock(mutex_);
  const auto found = owners_of_ids_.find(id);
  if (found != owners_of_ids_.end() && found->second.get() == &asked) {
    owners_of_ids_.erase(found);
  }
}

}  // namespace wellspace::client
