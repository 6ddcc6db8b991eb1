// Helpers of the files of SessionLife: requests by a client's knowledge, and checks of the answers.
#ifndef WELLSPACE_TESTS_SERVER_HISTORIES_SESSION_LIFE_CALLS_H_
#define WELLSPACE_TESTS_SERVER_HISTORIES_SESSION_LIFE_CALLS_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/strings/str_cat.h"
#include "tests/server/histories/session_life.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {

constexpr char kLabel[] = "client";
constexpr int64_t kShortTtl = 60;  // seconds; sessions that have it expire with the next Step::kExpire

// The fault of a call that came back with an error while its server lived.
template <typename Response>
std::string ErrorOf(const char* call, const Answered<Response>& answered) {
  return answered.error.has_value() ? absl::StrCat(call, " ends with ", answered.error->error_message()) : "";
}

inline std::string Differs(const char* what, uint64_t found, uint64_t expected) {
  return found == expected ? "" : absl::StrCat(what, " is ", found, ", and should be ", expected);
}

inline v1::SetSizesRequest SizesRequestOf(const KnownSession& session) {
  v1::SetSizesRequest request;
  request.set_name(session.name);
  for (size_t i = 0; i < session.sizes.size(); ++i) {
    if (i % (session.dimension + 1) < session.dimension) {
      request.mutable_samples()->add_points(session.sizes[i]);
    } else {
      request.mutable_samples()->add_sizes(session.sizes[i]);
    }
  }
  return request;
}

// Those from number `first` on.
inline v1::AddSegmentsRequest SegmentsRequestOf(const KnownSession& session, size_t first) {
  v1::AddSegmentsRequest request;
  request.set_name(session.name);
  request.set_segment_offset(first);
  request.mutable_segments()->mutable_ends()->Add(session.segment_ends.begin() + static_cast<std::ptrdiff_t>(2 * first),
                                                  session.segment_ends.end());
  request.mutable_faces()->set_faces(v1::FACE_RULE_BOX);
  return request;
}

// Those from number `first` on.
inline v1::AddTrianglesRequest TrianglesRequestOf(const KnownSession& session, size_t first) {
  v1::AddTrianglesRequest request = BlockRequest(session.name);
  v1::TriangleChunk& triangles = *request.mutable_triangles();
  request.set_triangle_offset(first);
  triangles.mutable_corners()->Truncate(static_cast<int>(3 * session.triangles));
  triangles.mutable_corners()->ExtractSubrange(0, static_cast<int>(3 * first), nullptr);
  triangles.mutable_markers()->Truncate(static_cast<int>(session.triangles));
  triangles.mutable_markers()->ExtractSubrange(0, static_cast<int>(first), nullptr);
  return request;
}

inline std::string OperationName(const KnownSession& session, uint64_t number) {
  return absl::StrCat(session.name, "/operations/", number);
}

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_HISTORIES_SESSION_LIFE_CALLS_H_
