#include "server/services/session_fields.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "core/partition/partition.h"
#include "server/security/tokens.h"
#include "server/services/page_token.h"
#include "server/wire/convert.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

constexpr int kMaxLabels = 64;
constexpr size_t kMaxKeyCharacters = 63;
constexpr size_t kMaxValueCharacters = 255;
constexpr size_t kMaxParametersBytes = size_t{kMaxResponseBytes} / 2;
constexpr absl::Duration kMinTtl = absl::Seconds(1);
constexpr uint32_t kMostGhostLayers = 16;
constexpr size_t kMostShown = 64;  // bytes of a wrong name in a message
constexpr int32_t kNanosPerSecond = 1'000'000'000;

// Of UTF-8, which protocol buffers have checked.
size_t CharactersOf(std::string_view text) {
  return std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; });
}

absl::Status Invalid(const std::string& message, const std::string& field) {
  return MakeError(v1::ERROR_REASON_INVALID_REQUEST, message, field);
}

std::string BoxToString(const std::vector<double>& low, const std::vector<double>& high) {
  return low.empty() ? "no domain"
                     : absl::StrCat("(", absl::StrJoin(low, ", "), ") to (", absl::StrJoin(high, ", "), ")");
}

}  // namespace

absl::StatusOr<Labels> LabelsFromProto(const google::protobuf::Map<std::string, std::string>& message,
                                       const std::string& field) {
  if (message.size() > kMaxLabels) {
    return Invalid(absl::StrCat("there are ", message.size(), " labels; at most ", kMaxLabels, " are accepted"), field);
  }
  for (const auto& [key, value] : message) {
    if (const size_t count = CharactersOf(key); count < 1 || count > kMaxKeyCharacters) {
      return Invalid(
          absl::StrCat("the key of a label has ", count, " characters; 1 to ", kMaxKeyCharacters, " are accepted"),
          field);
    }
    if (const size_t count = CharactersOf(value); count > kMaxValueCharacters) {
      return Invalid(absl::StrCat("the value of label \"", key, "\" has ", count, " characters; at most ",
                                  kMaxValueCharacters, " are accepted"),
                     field);
    }
  }
  return Labels(message.begin(), message.end());
}

absl::StatusOr<absl::Duration> TtlFromProto(const google::protobuf::Duration* message, const std::string& field,
                                            const ServiceOptions& options) {
  if (message == nullptr) {
    return options.default_ttl;
  }
  const absl::Duration ttl = absl::Seconds(message->seconds()) + absl::Nanoseconds(message->nanos());
  const bool is_duration = std::abs(message->nanos()) < kNanosPerSecond;
  if (!is_duration || ttl < kMinTtl || ttl > options.max_ttl) {
    return Invalid(
        absl::StrCat(field, " is ", message->seconds(), " s and ", message->nanos(), " ns; ",
                     absl::FormatDuration(kMinTtl), " to ", absl::FormatDuration(options.max_ttl), " are accepted"),
        field);
  }
  return ttl;
}

absl::StatusOr<size_t> PageSizeFromProto(const int32_t* page_size) {
  if (page_size == nullptr) {
    return kMaxPageSize;
  }
  if (*page_size < 1) {
    return Invalid(absl::StrCat("page_size is ", *page_size, "; 1 or more is accepted, or nothing for ", kMaxPageSize),
                   "page_size");
  }
  return std::min(*page_size, kMaxPageSize);
}

absl::Status CheckPartition(const v1::MeshPartition& partition) {
  if (partition.parts() == 0 || partition.parts() > core::kMaxParts) {
    return Invalid(absl::StrCat("partition.parts is ", partition.parts(), "; expected 1 to ", core::kMaxParts),
                   "partition.parts");
  }
  if (partition.part() >= partition.parts()) {
    return Invalid(absl::StrCat("partition.part is ", partition.part(), "; of ", partition.parts(),
                                " parts, which are numbered from 0, the last is ", partition.parts() - 1),
                   "partition.part");
  }
  if (partition.ghost_layers() > kMostGhostLayers) {
    return Invalid(
        absl::StrCat("partition.ghost_layers is ", partition.ghost_layers(), "; expected 0 to ", kMostGhostLayers),
        "partition.ghost_layers");
  }
  return absl::OkStatus();
}

absl::Status CheckPartitionOf(uint64_t simplices, const v1::MeshPartition& partition) {
  return partition.parts() <= simplices
             ? absl::OkStatus()
             : Invalid(absl::StrCat("partition.parts is ", partition.parts(), "; the mesh has ", simplices,
                                    " simplices, and each part has at least one"),
                       "partition.parts");
}

absl::StatusOr<uint64_t> RevisionFromProto(bool is_sent, uint64_t revision, const std::string& field) {
  if (is_sent && revision == 0) {
    return Invalid(absl::StrCat(field, " is 0; revisions begin with 1, and nothing stands for any"), field);
  }
  return revision;
}

absl::StatusOr<std::string> PositionFromProto(const std::string& token, const std::string& list) {
  const std::optional<std::string> read = token.empty() ? std::string() : ReadPageToken(list, token);
  if (!read.has_value()) {
    return Invalid("page_token was not given for this list; expected next_page_token of the page before, or none",
                   "page_token");
  }
  return *read;
}

absl::StatusOr<uint64_t> NumberFromProto(const std::string& token, const std::string& list) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string position, PositionFromProto(token, list));
  return NumberAt(position).value_or(0);
}

absl::Status CheckTenant(const std::string& tenant) {
  return tenant.empty() || IsTenantName(tenant)
             ? absl::OkStatus()
             : Invalid(absl::StrCat("tenant is \"", absl::Utf8SafeCHexEscape(tenant.substr(0, kMostShown)),
                                    "\"; expected the name of a tenant, or none"),
                       "tenant");
}

absl::Status CheckParametersSize(const core::MeshParameters& parameters) {
  const size_t bytes = ParametersToProto(parameters).ByteSizeLong();
  return bytes <= kMaxParametersBytes
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_INVALID_PARAMETERS,
                         absl::StrCat("size_boxes has ", parameters.size_boxes.size(), " boxes, and the parameters ",
                                      bytes, " bytes; a session's may have at most ", kMaxParametersBytes),
                         "parameters.size_boxes");
}

absl::StatusOr<core::MeshParameters> ParametersForSession(const v1::MeshParameters& message,
                                                          const ServiceOptions& options, const Session& session) {
  WELLSPACE_ASSIGN_OR_RETURN(core::MeshParameters parameters, ParametersFromProto(message, options));
  WELLSPACE_RETURN_IF_ERROR(CheckParametersSize(parameters));
  const core::MeshParameters known = *session.state()->parameters;
  if (parameters.dimension != known.dimension) {
    return MakeError(v1::ERROR_REASON_INVALID_PARAMETERS,
                     absl::StrCat("dimension is ", parameters.dimension, ", but that of the session is ",
                                  known.dimension, " and cannot change"),
                     "parameters.dimension");
  }
  if (message.has_domain() &&
      (parameters.domain_low != known.domain_low || parameters.domain_high != known.domain_high)) {
    return MakeError(
        v1::ERROR_REASON_INVALID_PARAMETERS,
        absl::StrCat("domain is ", BoxToString(parameters.domain_low, parameters.domain_high), ", but the session has ",
                     BoxToString(known.domain_low, known.domain_high), ", which cannot change; leave it out"),
        "parameters.domain");
  }
  const bool sets_margin = message.has_margin() && known.domain_low.empty();
  if (sets_margin && parameters.margin != known.margin) {
    return MakeError(v1::ERROR_REASON_INVALID_PARAMETERS,
                     absl::StrCat("margin is ", parameters.margin, ", but the session has ", known.margin,
                                  ", which cannot change as the domain depends on it; leave it out"),
                     "parameters.margin");
  }
  if (message.has_merge_distance() && parameters.merge_distance != known.merge_distance) {
    return MakeError(v1::ERROR_REASON_INVALID_PARAMETERS,
                     absl::StrCat("merge_distance is ", parameters.merge_distance, ", but the session has ",
                                  known.merge_distance, ", which cannot change; leave it out"),
                     "parameters.merge_distance");
  }
  if (!parameters.periodic_axes.empty() && parameters.periodic_axes != known.periodic_axes) {
    const auto text = [](const std::vector<int>& axes) {
      return axes.empty() ? std::string("none") : absl::StrJoin(axes, ", ");
    };
    return MakeError(v1::ERROR_REASON_INVALID_PARAMETERS,
                     absl::StrCat("periodic_axes are ", text(parameters.periodic_axes), ", but the session has ",
                                  text(known.periodic_axes), ", which cannot change; leave them out"),
                     "parameters.periodic_axes");
  }
  if (parameters.pump_weights && !known.periodic_axes.empty()) {
    return MakeError(v1::ERROR_REASON_INVALID_PARAMETERS,
                     "pump_weights: true is not allowed, since the box of the session is periodic; leave it out",
                     "parameters.pump_weights");
  }
  parameters.periodic_axes = known.periodic_axes;
  parameters.merge_distance = known.merge_distance;
  parameters.domain_low = known.domain_low;
  parameters.domain_high = known.domain_high;
  parameters.margin = known.margin;
  return parameters;
}

}  // namespace wellspace::server
