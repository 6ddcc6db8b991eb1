#include "client/grpc/delta_receiver.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client/grpc/convert.h"
#include "client/grpc/mesh_receiver.h"
#include "client/grpc/mesh_values.h"
#include "client/mesh_sink.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"

namespace wellspace::client {
namespace {

template <typename T>
using Field = google::protobuf::RepeatedField<T>;

template <typename... Parts>
absl::Status MisfitOf(const Parts&... parts) {
  return absl::DataLossError(absl::StrCat("the server's answer is damaged: a difference ", parts...));
}

// Rows that are kept, then rows that are new.
struct Run {
  uint64_t begin = 0;
  uint64_t kept = 0;
  uint64_t added = 0;
};

// The runs of an array of `rows` rows from one of `base_rows`, of which each is kept once at most, with `added` new
// ones.
absl::StatusOr<std::vector<Run>> ReadRuns(const v1::KeptRows& message, uint64_t base_rows, uint64_t rows,
                                          uint64_t added) {
  if (message.skipped_size() != message.kept_size() || message.kept_size() != message.added_size()) {
    return MisfitOf("with ", message.skipped_size(), ", ", message.kept_size(), " and ", message.added_size(),
                    " numbers of runs");
  }
  std::vector<Run> runs;
  uint64_t expected = 0;
  uint64_t kept = 0;
  uint64_t taken = 0;
  for (int i = 0; i < message.kept_size(); ++i) {
    const Run run = {.begin = expected + static_cast<uint64_t>(message.skipped(i)),
                     .kept = message.kept(i),
                     .added = message.added(i)};
    if (run.begin > base_rows || run.kept > base_rows - run.begin || run.kept > base_rows - kept ||
        run.added > added - taken) {
      return MisfitOf("keeps ", run.kept, " rows from row ", run.begin, " on, of ", base_rows, ", and has ", run.added,
                      " new ones");
    }
    runs.push_back(run);
    expected = run.begin + run.kept;
    kept += run.kept;
    taken += run.added;
  }
  return taken == added && kept + taken == rows ? absl::StatusOr<std::vector<Run>>(std::move(runs))
                                                : MisfitOf("keeps ", kept, " rows, and ", taken, " are new, of ", rows);
}

uint64_t MostOf(const v1::KeptRows& rows) {
  return std::max({rows.skipped_size(), rows.kept_size(), rows.added_size()});
}

// Appends the rows that the runs take from `base` and from `added`.
template <typename T, typename Added>
void JoinRuns(const std::vector<Run>& runs, const std::vector<T>& base, Added added, size_t width,
              std::vector<T>* joined) {
  for (const Run& run : runs) {
    const auto first = base.begin() + run.begin * width;
    joined->insert(joined->end(), first, first + run.kept * width);
    joined->insert(joined->end(), added, added + run.added * width);
    added += run.added * width;
  }
}

absl::StatusOr<std::vector<Run>> ApplyKept(const std::vector<uint32_t>& base, const v1::KeptRows& kept,
                                           const Field<uint32_t>& added, size_t width, uint64_t rows,
                                           std::vector<uint32_t>* next) {
  if (added.size() % width != 0) {
    return MisfitOf("with ", added.size(), " numbers in rows of ", width);
  }
  WELLSPACE_ASSIGN_OR_RETURN(std::vector<Run> runs, ReadRuns(kept, base.size() / width, rows, added.size() / width));
  next->reserve(rows * width);
  JoinRuns(runs, base, added.begin(), width, next);
  return runs;
}

// Puts values into the rows that `gaps` list.
template <typename T>
absl::Status PutChanged(const Field<uint32_t>& gaps, const Field<T>& values, size_t width, std::vector<T>& array) {
  uint64_t row = 0;
  auto value = values.begin();
  for (const uint32_t gap : gaps) {
    row += gap;
    if (row >= array.size() / width || static_cast<size_t>(values.end() - value) < width) {
      return MisfitOf("changes row ", row, " of ", array.size() / width);
    }
    std::copy_n(value, width, array.begin() + row * width);
    value += width;
    ++row;
  }
  return absl::OkStatus();
}

template <typename T>
absl::Status ApplyChanged(const std::vector<T>& base, const Field<uint32_t>& gaps, const Field<T>& values, size_t width,
                          uint64_t rows, std::vector<T>* next) {
  const uint64_t kept = std::min<uint64_t>(base.size() / width, rows);
  if ((rows - kept + gaps.size()) * width != static_cast<uint64_t>(values.size())) {
    return MisfitOf("with ", values.size(), " numbers for ", gaps.size(), " changed and ", rows - kept, " new rows of ",
                    width);
  }
  next->reserve(rows * width);
  next->assign(base.begin(), base.begin() + kept * width);
  WELLSPACE_RETURN_IF_ERROR(PutChanged(gaps, values, width, *next));
  next->insert(next->end(), values.begin() + gaps.size() * width, values.end());
  return absl::OkStatus();
}

absl::Status ApplyRegions(const std::vector<int32_t>& base, const v1::MeshDelta& delta, const std::vector<Run>& runs,
                          uint64_t base_rows, uint64_t rows, std::vector<int32_t>* next) {
  if (base.empty() || rows == 0) {
    return ApplyChanged({}, delta.changed_simplex_regions(), delta.simplex_regions(), 1, rows, next);
  }
  uint64_t added = 0;
  for (const Run& run : runs) {
    added += run.added;
  }
  const int changed = delta.changed_simplex_regions_size();
  if (base.size() != base_rows || changed + added != static_cast<uint64_t>(delta.simplex_regions_size())) {
    return MisfitOf("with regions of other simplices");
  }
  JoinRuns(runs, base, delta.simplex_regions().begin() + changed, 1, next);
  return PutChanged(delta.changed_simplex_regions(), delta.simplex_regions(), 1, *next);
}

absl::Status ReadList(const Field<uint32_t>& gaps, uint64_t end, std::vector<uint32_t>* numbers) {
  uint64_t number = 0;
  for (const uint32_t gap : gaps) {
    number += gap;
    if (number >= end) {
      return MisfitOf("names vertex ", number, " of ", end);
    }
    numbers->push_back(static_cast<uint32_t>(number));
    ++number;
  }
  return absl::OkStatus();
}

template <typename T>
bool HasChecksum(const std::vector<T>& values, uint32_t checksum) {
  return Crc32c(values.data(), values.size() * sizeof(T)) == checksum;
}

bool HasChecksums(const Mesh& mesh, const v1::MeshChecksums& checksums) {
  return HasChecksum(mesh.points, checksums.points()) && HasChecksum(mesh.weights, checksums.weights()) &&
         HasChecksum(mesh.simplices, checksums.simplices()) &&
         HasChecksum(mesh.input_vertex, checksums.input_vertices()) &&
         HasChecksum(mesh.vertex_origins, checksums.vertex_origins()) &&
         HasChecksum(mesh.vertex_tags, checksums.vertex_tags()) &&
         HasChecksum(mesh.simplex_regions, checksums.simplex_regions()) &&
         HasChecksum(mesh.facets, checksums.facets()) && HasChecksum(mesh.ridges, checksums.ridges());
}

// Whether there can be a mesh with this header and these arrays.
absl::Status CheckArrays(const MeshHeader& header, const Mesh& mesh) {
  WELLSPACE_RETURN_IF_ERROR(CheckPoints(mesh.points));
  WELLSPACE_RETURN_IF_ERROR(CheckWeights(mesh.weights));
  WELLSPACE_RETURN_IF_ERROR(CheckVertices(header, "simplices", mesh.simplices));
  WELLSPACE_RETURN_IF_ERROR(CheckVertices(header, "facets", mesh.facets));
  WELLSPACE_RETURN_IF_ERROR(CheckVertices(header, "ridges", mesh.ridges));
  WELLSPACE_RETURN_IF_ERROR(CheckInputVertices(header, mesh.input_vertex));
  WELLSPACE_RETURN_IF_ERROR(CheckOrigins(header, mesh.vertex_origins));
  WELLSPACE_RETURN_IF_ERROR(CheckTags(header, mesh.vertex_tags));
  return CheckRegions(header, mesh.simplex_regions);
}

}  // namespace

absl::Status DeltaReceiver::SetMetadata(const v1::MeshMetadata& metadata) {
  if (!expects_metadata_) {
    return MisfitOf("of which parts are missing");
  }
  MeshHeader header = HeaderFromProto(metadata);
  WELLSPACE_RETURN_IF_ERROR(CheckHeader(header, {.dimension = mesh_.dimension, .input_points = std::nullopt}));
  if (metadata.delta().base_revision() != mesh_.revision) {
    return MisfitOf("from the mesh of revision ", metadata.delta().base_revision(), "; that of revision ",
                    mesh_.revision, " is there");
  }
  if (header.revision == mesh_.revision) {
    return header.chunk_count == 0 ? absl::OkStatus() : MisfitOf("of ", header.chunk_count, " parts from itself");
  }
  if (is_begun_ && (header.revision != header_.revision || header.chunk_count != header_.chunk_count)) {
    return MisfitOf("to revision ", header.revision, " goes on where one to revision ", header_.revision, " ended");
  }
  is_begun_ = true;
  header_ = std::move(header);
  checksums_ = metadata.delta().checksums();
  expects_metadata_ = next_part_ == header_.chunk_count;
  return expects_metadata_ ? Apply() : absl::OkStatus();
}

absl::Status DeltaReceiver::AddPart(const v1::MeshDelta& part) {
  if (expects_metadata_ || part.index() != next_part_) {
    return MisfitOf("with part ", part.index(), " where part ", next_part_, " of ", header_.chunk_count,
                    " was expected");
  }
  delta_.MergeFrom(part);
  WELLSPACE_RETURN_IF_ERROR(CheckSizes());
  ++next_part_;
  expects_metadata_ = next_part_ == header_.chunk_count;
  return expects_metadata_ ? Apply() : absl::OkStatus();
}

absl::Status DeltaReceiver::CheckSizes() const {
  const uint64_t dimension = header_.dimension;
  const auto fits = [](uint64_t count, uint64_t most) { return count <= most; };
  const bool do_fit =
      fits(delta_.changed_points_size(), header_.vertex_count) &&
      fits(delta_.points_size(), header_.vertex_count * dimension) &&
      fits(delta_.changed_weights_size(), header_.vertex_count) && fits(delta_.weights_size(), header_.vertex_count) &&
      fits(MostOf(delta_.kept_simplices()), header_.simplex_count) &&
      fits(delta_.simplices_size(), header_.simplex_count * (dimension + 1)) &&
      fits(delta_.changed_input_vertices_size(), header_.input_point_count) &&
      fits(delta_.input_vertices_size(), header_.input_point_count) &&
      fits(delta_.moved_vertices_size(), header_.moved_vertex_count) &&
      fits(delta_.changed_vertex_origins_size(), header_.vertex_count) &&
      fits(delta_.vertex_origins_size(), header_.vertex_count) &&
      fits(delta_.changed_vertex_tags_size(), header_.vertex_count) &&
      fits(delta_.vertex_tags_size(), header_.vertex_count) &&
      fits(delta_.changed_simplex_regions_size(), header_.simplex_count) &&
      fits(delta_.simplex_regions_size(), header_.simplex_count) &&
      fits(MostOf(delta_.kept_facets()), header_.facet_count) &&
      fits(delta_.facets_size(), header_.facet_count * dimension) &&
      fits(MostOf(delta_.kept_ridges()), header_.ridge_count) && fits(delta_.ridges_size(), header_.ridge_count * 2);
  return do_fit ? absl::OkStatus() : MisfitOf("larger than the mesh of ", header_.vertex_count, " vertices");
}

absl::Status DeltaReceiver::Apply() {
  const v1::MeshDelta delta = std::exchange(delta_, v1::MeshDelta());
  next_part_ = 0;
  is_begun_ = false;
  const size_t dimension = mesh_.dimension;
  const uint64_t vertices = header_.vertex_count;
  const uint64_t marks = header_.has_vertex_marks ? vertices : 0;
  Mesh next;
  WELLSPACE_RETURN_IF_ERROR(
      ApplyChanged(mesh_.points, delta.changed_points(), delta.points(), dimension, vertices, &next.points));
  WELLSPACE_RETURN_IF_ERROR(ApplyChanged(mesh_.weights, delta.changed_weights(), delta.weights(), 1,
                                         header_.has_weights ? vertices : 0, &next.weights));
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<Run> runs,
                             ApplyKept(mesh_.simplices, delta.kept_simplices(), delta.simplices(), dimension + 1,
                                       header_.simplex_count, &next.simplices));
  WELLSPACE_RETURN_IF_ERROR(ApplyChanged(mesh_.input_vertex, delta.changed_input_vertices(), delta.input_vertices(), 1,
                                         header_.input_point_count, &next.input_vertex));
  WELLSPACE_RETURN_IF_ERROR(ApplyChanged(mesh_.vertex_origins, delta.changed_vertex_origins(), delta.vertex_origins(),
                                         1, marks, &next.vertex_origins));
  WELLSPACE_RETURN_IF_ERROR(
      ApplyChanged(mesh_.vertex_tags, delta.changed_vertex_tags(), delta.vertex_tags(), 1, marks, &next.vertex_tags));
  WELLSPACE_RETURN_IF_ERROR(ApplyRegions(mesh_.simplex_regions, delta, runs, mesh_.simplices.size() / (dimension + 1),
                                         header_.has_simplex_regions ? header_.simplex_count : 0,
                                         &next.simplex_regions));
  WELLSPACE_RETURN_IF_ERROR(
      ApplyKept(mesh_.facets, delta.kept_facets(), delta.facets(), dimension, header_.facet_count, &next.facets)
          .status());
  WELLSPACE_RETURN_IF_ERROR(
      ApplyKept(mesh_.ridges, delta.kept_ridges(), delta.ridges(), 2, header_.ridge_count, &next.ridges).status());
  WELLSPACE_RETURN_IF_ERROR(ReadList(delta.moved_vertices(), vertices, &next.moved_vertices));
  if (next.moved_vertices.size() != header_.moved_vertex_count || !HasChecksums(next, checksums_)) {
    return MisfitOf("that makes another mesh than that of revision ", header_.revision);
  }
  WELLSPACE_RETURN_IF_ERROR(CheckArrays(header_, next));
  SetHeader(header_, next);
  mesh_ = std::move(next);
  return absl::OkStatus();
}

}  // namespace wellspace::client
